"""Linear elasticity of one stone: operators, stress, recovery at the nodes, error estimate.

Public: `ElasticOperators`, `elastic_operators` (operators); `recovery` (recovery); `sampled_stress`, `stress_error`
(stress); `principal`, `von_mises` (tensors).
"""
