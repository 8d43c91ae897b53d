"""Many missions on a GPU."""
