"""Automatic choice among solvers."""
