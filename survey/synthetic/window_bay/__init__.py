"""The sample survey of a wall with a window.

Public: `make_sample`, `write_sample`, `truth_of`, `truth_text` (sample); `plan_window` (window).
"""
