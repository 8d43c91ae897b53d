"""What PettingZoo and Gymnasium call."""
