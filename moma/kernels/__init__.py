"""Compilation of kernels on the first use, by a second process beside the command that needs them.

Public: `compiling_beside` (beside); `KernelUse`, `kernels_of` (uses).
"""
