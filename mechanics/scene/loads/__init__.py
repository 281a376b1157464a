"""Loads: what acts on a scene besides its weight, as functions of time."""
