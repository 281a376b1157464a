"""Observers: what is measured while a scene runs."""
