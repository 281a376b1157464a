"""Orientation of photographs (`moma orient`).

Public: `read_project` (project); `orient_photographs`, `OrientReport` (orient).
"""
