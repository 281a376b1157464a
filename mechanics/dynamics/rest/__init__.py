"""Bodies at rest: kinetic damping, which halts them, and sleep, which holds them.

Public: `Relaxation`, `halted` (relaxation); `Sleepers` (sleeping).
"""
