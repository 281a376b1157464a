"""Results of a run: positions, stresses, contact forces, joints.

Public: `Result`, `BodyResult`, `Frame`, `RunHistory`, `StepHistory`, `Errors`, `Peaks`, `Series` (result);
`ContactResult`, `JointResult` (contact_result); `StageResult` (stages); `Log`, `StepLog` (log); `StressValues`
(stress_values); `Observer` (postprocess); `PeakTracker` (peaks).
"""
