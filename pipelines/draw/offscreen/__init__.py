"""Three-dimensional pictures, drawn by PyVista in a child process.

Public: `wall_surface`, `WallSurface` (surfaces); `ClosingSurface` (closing); `save_job`, `run_job` (jobs).
"""
