"""Policies that plan routes for the whole fleet, waypoint by waypoint, and fly along them fast."""
