"""Drawings of point clouds, over which outlines of stones are drawn.

Public: `DrawnCloud`, `draw_views` (views).
"""
