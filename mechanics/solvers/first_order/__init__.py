"""First-order solvers: NSGS, ADMM and APGD."""
