"""Numba kernels of clouds: points into stones, planes of their patches, lines and regions of their pictures."""
