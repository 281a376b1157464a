"""Methods of a study, as functions of samples at points in standard normal space; none knows stones.

Public: `Evaluate`, `Failure` (failure); `controlled`, `mean_of`, `probability` (counting); `Sides`, `first_order`
(first_order); `Design`, `design_points` (design_points); `importance` (importance); `subset` (subset); `sobol`
(sobol).
"""
