"""Compiled loops of the Delassus operators."""
