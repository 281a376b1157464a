"""Compiled loops of plane fits, outlines and shape models."""
