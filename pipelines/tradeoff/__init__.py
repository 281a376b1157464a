"""Studies of speed against accuracy on a scene (`moma trade`).

Public: `run_trade`, `Asked`, `TradeReport` (study); `grid`, `Variant` (grid); `front`, `judge` (pareto); `Store`
(store).
"""
