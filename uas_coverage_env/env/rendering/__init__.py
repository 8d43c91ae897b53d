"""Pictures and windows of what an environment flies."""
