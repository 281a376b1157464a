"""Compiled loops of the contact solvers."""
