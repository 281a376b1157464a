"""Strategies: automatic choice among solvers, by the bodies and the observed convergence.

Public: `Auto` (auto); `Compliant` (compliant); `Alternating`, `moving_admm` (rigid); `Elastic` (elastic); `Planar`
(planar).
"""
