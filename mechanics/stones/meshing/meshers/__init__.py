"""Meshers, one per module."""
