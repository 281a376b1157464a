"""Numba kernels of pictures: contrasts along lines, and regions that are flooded."""
