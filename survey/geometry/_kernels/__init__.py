"""Compiled loops over faces, edges and corners of solids."""
