"""Elevations drawn with matplotlib."""
