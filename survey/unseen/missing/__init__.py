"""Missing stones: gaps, openings and arches."""
