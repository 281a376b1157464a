"""Forecast of the time and memory of a run.

Public: `plan`, `loose_blocks`, `Plan`, `Amounts` (plan); `expected_cost`, `ExpectedCost` (cost); `Rate`, `RATES`
(cost_rates).
"""
