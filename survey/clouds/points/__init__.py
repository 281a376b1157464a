"""Readers of point clouds, which pass them on in chunks of bounded size.

Public: `Chunk`, `PointCloud` (chunks); `open_points`, `CLOUDS` (reading).
"""
