"""Missions at places on the Earth: areas that were drawn become scenarios, flights become files.

Needs the extra `ops`.
"""
