"""Point lists: CSV, PNEZD and PENZD."""
