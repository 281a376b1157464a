"""Experiments: folds, faults, compression, wedges and heaps.

Public: `Experiment`, `Setup` (experiment); `Fold` (fold); `Fault` (fault); `Deposition` (deposition).
"""
