"""Closed solids with planar faces: cutting, convex parts, adjacency, folds."""
