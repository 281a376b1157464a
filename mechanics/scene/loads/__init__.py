"""Loads on a scene besides its weight, as functions of time.

Public: `Loads`, `Force`, `Motion`, `Pose` (load); `History` (time_series); `StoneForce` (forces); `GravityRamp`,
`TiltingTable` (gravity); `GroundMotion`, `Component`, `braking_time` (ground_motion); `ImposedMotion`, `settlement`,
`spreading` (motions); `Accelerogram` (accelerogram); `read_accelerogram` (record_files); `band_pass`, `without_drift`
(record_processing); `read_history` (tables).
"""
