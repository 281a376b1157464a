"""Limit analysis of rigid stones: how far a load may grow before they move, and how they would.

Public: `Assembly`, `assembly` (assembly); `Acceleration`, `LiveLoad`, `PointForce` (live_loads); `Flow`, `LimitLoad`,
`limit_load` (limit_load).
"""
