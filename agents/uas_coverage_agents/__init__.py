"""Learners: trained policies that fly the same scenarios as the planners."""
