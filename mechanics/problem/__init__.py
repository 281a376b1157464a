"""Contact problem of one step: statement, residual and exact local solution.

Public: `ContactProblem`, `ContactSolution`, `ContactStart`, `Delassus`, `GaussSeidel`, `RigidContacts`,
`ScaledDelassus`, `mean_diagonal` (problem); `Form`, `SparseForm` (forms); `Residual`, `natural_map`, `residual`,
`project_on_cone` (residual); `check_problem` (validation).
"""
