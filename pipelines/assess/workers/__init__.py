"""Worker processes and the records of their samples, for diagnoses and studies.

Public: `Lost`, `workers` (pool); `Sample`, `SampleStore`, `Snapshot` (store).
"""
