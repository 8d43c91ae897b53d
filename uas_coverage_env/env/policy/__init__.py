"""What policies see and do outside of the environments."""
