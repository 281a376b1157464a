"""Synthetic samples: buildings measured as a surveyor would, with their truth, and a scene that runs.

Public: `SyntheticBuilding`, `measured_building` (building); `true_joints` (true_joints); `SAMPLES`,
`recipe_of` (samples); `WrittenSample`, `write_sample` (write).
"""
