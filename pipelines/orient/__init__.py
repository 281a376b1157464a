"""Orientation of photographs (`moma orient`), from the project file to its results.

Public: `read_project`, `Project` (project); `orient_photographs`, `OrientReport` (orient).
"""
