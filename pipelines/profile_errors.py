"""What `python -m benchmarks.profiles --write` has measured on the reference scenes; not written by hand."""

from collections.abc import Mapping

__all__ = ["COLLAPSE", "ERRORS"]

ERRORS: Mapping[str, Mapping[str, tuple[float, float, float]]] = {
    "fast": {
        "joint_forces": (0.315, 0.000372, 0.26),
        "support_reactions": (0.04, 3.9e-07, 0.0306),
        "displacement": (0.994, 0.886, 0.994),
        "stone_displacement": (1.54, 0.999, 1.54),
        "settlement": (0.999, 0.807, 0.999),
    },
    "balanced": {
        "stone_von_mises_mean": (0.373, 0.012, 0.0379),
        "stone_von_mises_p99": (1.01, 0.0355, 0.0792),
        "joint_forces": (0.546, 7.7e-07, 0.0109),
        "von_mises_mean": (0.344, 0.000296, 0.0233),
        "von_mises_p99": (0.559, 0.00506, 0.0184),
        "support_reactions": (0.178, 2.7e-08, 0.00538),
        "displacement": (0.433, 0.00529, 0.0294),
        "stone_displacement": (0.465, 0.00399, 0.0298),
        "settlement": (0.0643, 0.00182, 0.00595),
    },
    "accurate": {
        "stone_von_mises_mean": (0.0601, 0.00125, 0.00798),
        "stone_von_mises_p99": (0.609, 0.0144, 0.0353),
        "joint_forces": (0.182, 1.77e-07, 0.00743),
        "von_mises_mean": (0.0369, 0.000357, 0.00208),
        "von_mises_p99": (0.442, 0.00214, 0.0243),
        "support_reactions": (0.137, 9.83e-09, 0.00329),
        "displacement": (0.673, 0.000254, 0.037),
        "stone_displacement": (0.673, 0.00275, 0.037),
        "settlement": (0.12, 3.77e-05, 0.00661),
    },
}
"""By profile and quantity: the ratio of the error to its measure (pipelines.profile_report), and the least
and the largest error of the reference scenes."""

COLLAPSE: Mapping[str, float] = {
    "fast": 0.01,
    "balanced": 0.01,
    "accurate": 0.01,
}
"""By profile: the largest error of a load of collapse, or of a least thickness (benchmarks.collapse)."""
