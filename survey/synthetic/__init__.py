"""Synthetic buildings, measured as a surveyor would, with their true geometry; the sample is one of them.

Public: `Building`, `measured_building` (building); `measure_stone` (measure); `true_joints` (shared_faces);
`SAMPLES`, `storey_recipe` (samples).
"""
