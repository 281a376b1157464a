"""Solvers of one step's frictional contact problem, and the residual that judges them all."""
