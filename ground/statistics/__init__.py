"""Robust scale, scatter of differences, and roots of falling functions, for surveys and their campaigns.

Public: `CONSISTENT`, `deviation`, `spread`, `scatter_beyond` (scale); `root_of` (roots).
"""
