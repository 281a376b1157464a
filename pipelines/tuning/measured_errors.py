"""Errors on the reference scenes, written by `python -m benchmarks.profiles --write`, not by hand."""

from collections.abc import Mapping

ERRORS: Mapping[str, Mapping[str, tuple[float, float, float]]] = {
    "fast": {
        "joint_forces": (1.43, 4.72e-08, 0.612),
        "support_reactions": (0.689, 2.07e-08, 0.294),
        "displacement": (0.999, 0.908, 0.999),
        "stone_displacement": (1.03, 0.961, 1.03),
        "settlement": (1.0, 0.93, 1.0),
    },
    "balanced": {
        "stone_von_mises_p99": (0.902, 0.0397, 0.161),
        "stone_von_mises_mean": (0.558, 0.012, 0.0575),
        "von_mises_mean": (0.344, 0.000296, 0.0423),
        "von_mises_p99": (0.594, 0.00311, 0.0481),
        "joint_forces": (1.73, 7.7e-07, 0.0358),
        "support_reactions": (0.323, 6e-08, 0.00576),
        "displacement": (0.464, 0.00529, 0.0834),
        "stone_displacement": (0.465, 0.00464, 0.0617),
        "settlement": (0.33, 0.00182, 0.0593),
    },
    "accurate": {
        "stone_von_mises_p99": (0.67, 0.0162, 0.1),
        "stone_von_mises_mean": (0.155, 0.00145, 0.0154),
        "von_mises_mean": (0.0673, 0.000451, 0.00818),
        "von_mises_p99": (0.442, 0.00174, 0.0243),
        "joint_forces": (0.672, 1.77e-07, 0.00743),
        "support_reactions": (0.357, 3.52e-08, 0.00478),
        "displacement": (0.673, 0.000703, 0.037),
        "stone_displacement": (0.673, 0.00279, 0.037),
        "settlement": (0.12, 0.00026, 0.00673),
    },
}
"""By profile and quantity: the ratio of the error to its measure (pipelines.tuning.expected_errors), and
the least and the largest error of the reference scenes."""

COLLAPSE: Mapping[str, float] = {
    "fast": 0.0129,
    "balanced": 0.0129,
    "accurate": 0.00595,
}
"""By profile: the largest error of a load of collapse, or of a least thickness (benchmarks.profiles)."""
