"""Orientation of photographs (`moma orient`), from the project file to the page.

Public: `read_project`, `Project` (project); `orient_photographs`, `OrientReport` (orient); `photographs_section`
(page).
"""
