"""Studies: what is not known of a building, its probability of falling, and what to measure next.

Public: `Study`, `run_study` (study); `StudyFile`, `read_study` (file); `Part` (sampling).
"""
