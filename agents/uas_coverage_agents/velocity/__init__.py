"""Policies that fly with velocities: one network for every UAS, on the environment's view."""
