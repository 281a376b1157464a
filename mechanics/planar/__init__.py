"""Disks and straight walls in the plane, with the laws and solvers of the stones.

Public: `Disk`, `PlanarScene`, `PlanarTime`, `Wall` (scene); `simulate_planar`, `PlanarObserver` (simulate); `PlanarRun`
(run); `PlanarResult`, `PlanarInstant` (result).
"""
