"""Readers of what was drawn or mapped: files as features, a module for each format."""
