"""Compiled code: kernels, the memory that they are handed, their cache on disk."""
