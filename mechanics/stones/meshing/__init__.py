"""Finite-element meshes of single stones."""
