"""Reference learners for the levels: known libraries, with settings as data (`learners/`)."""
