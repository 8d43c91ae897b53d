"""How an autopilot flies a file of legs: how long, how late it may be, and waits between UAS."""
