"""Worker processes and the records of their samples, for diagnoses, studies and trade-offs.

Public: `cluster` (cluster); `Lost`, `Worker`, `workers` (pool); `SAMPLES`, `Sample`, `SampleStore`, `Snapshot` (store).
"""
