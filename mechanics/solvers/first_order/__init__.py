"""First-order solvers: sweeps, splitting and projected gradients.

Public: `NSGS` (nsgs); `ADMM` (admm); `APGD` (apgd); `Anderson` (anderson).
"""
