"""Numerical stability at the extremes: every method on every row of a matrix, judged from outside."""
