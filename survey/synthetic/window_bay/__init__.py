"""The sample survey of a wall with a window."""
