"""What others install or name, and what went wrong in it."""
