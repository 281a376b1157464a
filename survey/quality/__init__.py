"""The survey report: precision, courses, contradictions, points to measure again."""
