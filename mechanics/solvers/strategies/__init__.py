"""Strategies: automatic choice among solvers, by the bodies and the observed convergence.

Public: `Auto` (auto); `Alternating`, `moving_admm` (rigid); `Elastic` (elastic); `Compliant` (compliant).
"""
