"""Many missions side by side, flown by one compiled call."""
