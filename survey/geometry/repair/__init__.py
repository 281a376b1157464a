"""Repair of surfaces from other programs that are nearly closed.

Public: `repair`, `Repaired` (repair); `simple_polygons` (polygons).
"""
