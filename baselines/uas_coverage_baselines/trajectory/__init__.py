"""`trajectory`: each UAS's whole mission as one convex program, flown as planned."""
