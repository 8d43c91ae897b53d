"""What is flown when no new plan comes: a backup trajectory of each UAS, verified together.

Its two guarantees, and what they do not cover: docs/safety.md.
"""
