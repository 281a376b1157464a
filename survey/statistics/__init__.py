"""Robust scale, scatter of differences, and roots of falling functions, for all rooms of the survey.

Public: `CONSISTENT`, `deviation`, `spread`, `scatter_beyond` (scale); `root_of` (roots).
"""
