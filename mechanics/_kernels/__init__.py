"""Compiled arithmetic that the rooms share."""
