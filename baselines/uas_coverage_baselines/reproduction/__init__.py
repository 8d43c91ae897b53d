"""The result section of Gasche et al., flown again: its figures beside ours, in one command."""
