"""Snapping of imported solids: faces that match get one plane.

Public: `snap` (snapping); `find_matches`, `common_planes`, `Match` (matching_faces).
"""
