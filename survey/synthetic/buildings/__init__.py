"""Synthetic walls, vaults and assemblies."""
