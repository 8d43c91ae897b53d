"""From a problem to a verified plan within the time of a decision."""
