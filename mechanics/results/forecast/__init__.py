"""Forecast of the time and memory of a run.

Public: `plan`, `Plan`, `Amounts` (plan); `expected_cost`, `ExpectedCost` (cost); `Rate`, `RATES` (cost_rates).
"""
