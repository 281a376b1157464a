"""A synthetic survey: a wall with a window that never stood, measured as a surveyor would, and its truth."""
