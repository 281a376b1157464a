"""Tetrahedral meshes of single stones."""
