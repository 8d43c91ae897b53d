"""Missions as an autopilot flies them from a file: few straight legs, from rest to rest."""
