"""Results of a run: positions, stresses, contact forces, joints.

Public: `Result`, `BodyResult`, `Frame`, `RunHistory`, `Errors`, `Peaks`, `Series` (result); `ContactResult`,
`JointResult` (contact_result); `StageResult` (stages); `Log` (log); `StressValues` (stress_values);
`Observer` (postprocess); `PeakTracker` (peaks).
"""
