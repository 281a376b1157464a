"""Geology with disks: scenes, samples, runs and what they show.

Public: `GeologyScene`, `read_geology` (file); `run_geology` (run).
"""
