"""Experiments: deposits, folds, faults, compression, wedges and heaps.

Public: `Experiment`, `Setup` (experiment); `Deposition` (deposition); `Fold` (fold); `Fault` (fault); `Biaxial`,
`SampleSides` (biaxial); `Membrane` (membrane); `Wedge` (wedge); `Repose` (repose).
"""
