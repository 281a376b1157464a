"""Compiled loops of the meshers."""
