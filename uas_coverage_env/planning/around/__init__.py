"""What is done round every planner, once, so that a planner plans; see `around.Around`."""
