"""Scene files: keys, selection, laws and loads."""
