"""First-order methods: sweeps and alternating directions.

Public: `NSGS` (nsgs); `BodyADMM`, `Stage` (body_admm); `DiskADMM` (disk_admm); `StonesAsRigid` (stones_as_rigid).
"""
