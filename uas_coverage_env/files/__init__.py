"""What is read and written: strict TOML with errors in one line, folders for results."""
