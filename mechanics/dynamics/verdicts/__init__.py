"""Verdict of a run: rest that lasts, collapse, or doubt left by steps that were not solved, and its words.

Public: `Watch`, `Verdict`, `MOVED` (watch); `LASTING`, `balance_of`, `disproof`, `rests` (lasting); `UnsolvedSteps`
(doubt).
"""
