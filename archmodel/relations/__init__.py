"""Relations, courses and arches computed from solids; load paths."""
