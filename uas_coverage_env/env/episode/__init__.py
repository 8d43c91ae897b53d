"""One mission as a learner flies it: its arrays, its compiled step, its settings."""
