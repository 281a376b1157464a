"""Scene packed into arrays: rigid bodies, deformable ones with their finite elements, contact surfaces.

Public: `Model`, `build_model`, `laws_between` (model); `ball` (balls); `Deformable`, `Compliance` (deformable);
`RigidInertia` (rigid).
"""
