"""What planners and learners share: what they allow for flights, and keep for the way home."""
