"""Pillar 3: bodies in unilateral contact — meshes, contacts, non-smooth dynamics, stresses."""
