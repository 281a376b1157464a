"""Numba kernels of clouds: points into stones, and planes of their patches."""
