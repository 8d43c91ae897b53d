"""What is flown when no plan comes, and what keeps a plan safe to the end."""
