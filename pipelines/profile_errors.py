"""What `python -m benchmarks.profiles --write` has measured on the reference scenes; not written by hand."""

from collections.abc import Mapping

__all__ = ["COLLAPSE", "ERRORS"]

ERRORS: Mapping[str, Mapping[str, tuple[float, float, float]]] = {"fast": {}, "balanced": {}, "accurate": {}}
"""By profile and quantity: the ratio of the error to its measure (pipelines.profile_report), and the least and
the largest error of the reference scenes."""

COLLAPSE: Mapping[str, float] = {"fast": 0.01, "balanced": 0.01, "accurate": 0.01}
"""By profile: the largest error of a load of collapse, or of a least thickness (benchmarks.collapse)."""
