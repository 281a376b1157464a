"""Solvers of contact problems: first order, second order, and strategies that combine them.

Public: `Solver`, `choose_solver`, `choose_planar_solver` (choice).
"""
