"""Elevations of facades, drawn with matplotlib.

Public: `draw_departure`, `draw_elevation`, `draw_residuals` (survey); `draw_courses` (beds); `draw_joints` (joints);
`draw_moved` (closing); `ClosingShapes`, `closing_shapes` (closing_shapes); `draw_bed_movement`,
`draw_misfit` (movement); `require_figures` (sheet).
"""
