"""Assessment of a scene: how far it is from falling under each load, and how it would fall.

Public: `Assessment`, `assess_scene` (assess); `parse_load`, `scene_loads` (loads).
"""
