"""Loading tests from scene file to capacity curve: the curve in a rig, its band, and a measured one beside it.

Public: `push` (push); `banded` (band); `mechanism_of`, `headline_of` (findings).
"""
