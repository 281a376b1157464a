"""Solvers of contact problems: one driver, chains as data, and the methods that they consist of.

Public: `choose_solver`, `choose_planar_solver` (choice); `Auto` (auto); `Solver`, `Link`, `follow` (chain).
"""
