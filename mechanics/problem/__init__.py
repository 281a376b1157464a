"""The contact problem of one step, its residual and its exact local solution."""
