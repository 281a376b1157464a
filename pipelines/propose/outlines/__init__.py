"""Outlines of stones proposed from a picture, reviewed or corrected, as files (`moma outlines`).

Public: `draw_outlines`, `DrawnOutlines`, `OutlineRequest`, `INDEX` (draw).
"""
