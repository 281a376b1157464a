"""Compiled kernels: those that a wheel carries, and those that a second process compiles on the first use.

Whoever loads kernels imports this package before numba, which learns here to read the kernels of a wheel.

Public: `compiling_beside` (beside); `use_packed_kernels` (packed); `KernelUse`, `kernels_of` (uses).
"""

from ground.kernels.packed import use_packed_kernels

use_packed_kernels()
