"""Numba kernels of the bundle adjustment."""
