"""From what was drawn on a map to a scenario: readers, site, obstacles, waypoints."""
