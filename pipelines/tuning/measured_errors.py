"""Errors on the reference scenes, measured by `python -m benchmarks.profiles --write`."""

import json
from collections.abc import Mapping
from importlib.resources import files

_MEASURED = json.loads(files(__package__).joinpath("measured_errors.json").read_text(encoding="utf-8"))

ERRORS: Mapping[str, Mapping[str, tuple[float, float, float]]] = {
    profile: {quantity: tuple(values) for quantity, values in errors.items()}
    for profile, errors in _MEASURED["errors"].items()
}
"""By profile and quantity: the ratio of the error to its measure (pipelines.tuning.expected_errors), and
the least and the largest error of the reference scenes."""

COLLAPSE: Mapping[str, float] = _MEASURED["collapse"]
"""By profile: the largest error of a load of collapse, or of a least thickness (benchmarks.profiles)."""
