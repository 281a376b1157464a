"""Time stepping: predict, detect, state, solve, advance."""
