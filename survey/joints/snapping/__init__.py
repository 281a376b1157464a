"""Snapping of imported solids: faces that match get one plane."""
