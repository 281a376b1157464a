"""Compiled loops of the planar engine."""
