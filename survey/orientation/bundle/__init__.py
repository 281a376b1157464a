"""Bundle adjustment: start values, least squares, precision and reliability, blunders.

Public: `orient`, `Orientation` (orient); `adjust`, `prepare` (adjustment); `statistics`, `Statistics` (statistics).
"""
