"""Policies that choose where to go: one network for every UAS, on the world's own routes."""
