"""Pillar 3: bodies in unilateral contact — meshes, contacts, non-smooth dynamics, stresses."""

import ground.kernels  # noqa: F401 - before numba
