"""Synthetic samples: buildings measured as a surveyor would, with their truth, and a scene that runs.

They stand beside the tests and are not installed: `moma sample` copies what they wrote, `pipelines/samples/files`, and
`python -m synthetic --ship` writes that again.

Public: `SyntheticBuilding`, `measured_building` (building); `true_joints` (true_joints); `SAMPLES`,
`recipe_of` (samples); `write_sample` (write).
"""
