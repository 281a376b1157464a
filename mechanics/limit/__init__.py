"""Limit analysis of rigid stones: how far a load may grow before they move, how they would, and what holds them.

Public: `RigidAssembly`, `Strength`, `assembly` (assembly); `Acceleration`, `LiveLoad`, `PointForce`, `SpreadForce`
(live_loads); `Flow`, `LimitLoad`, `Mechanism`, `limit_load`, `lines_of_sliding`, `slides_along_one_line`,
`without_friction_across` (limit_load); `HeldLimit`, `held_limit` (held); `Thrust`, `thrust` (thrust);
`GeometricSafety`, `geometric_safety` (thickness); `Kinematics`, `kinematics` (kinematic); `Confirmation`, `confirm`
(confirm); `Pushover`, `pushover` (pushover); `Joints`, `resultants` (joints); `JawPath`,
`LoadingTest`, `loading_test` (loading_test).
"""
