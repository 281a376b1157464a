"""Second-order solvers: Newton's methods, the interior point and cone programmes.

Public: `Newton` (newton); `ProximalNewton` (proximal_newton); `InteriorPoint` (interior_point); `ConeProgram`
(cone_program); `equilibrated` (scaling).
"""
