"""The joints of a run, for its report."""

import numpy as np

from mechanics.results.result import Result
from pipelines.arrays import Array
from pipelines.reports.html import kilopascals, millimetres, ratio, table

__all__ = ["joint_sections"]

_SEEN = 1e-6  # over the width of a joint: less is no movement that one could speak of

_KERN = (
    "<p>The resultant of a joint lies within its kern, up to 1 here, if a linear pressure under it presses the whole "
    "joint; beyond, part of the joint bears nothing. Where it reaches the edge, at 1 in the next column, a hinge forms."
    "</p>"
)


def joint_sections(result: Result) -> list[str]:
    """The ten joints with the most eccentric resultants, and those that slid or opened most."""
    joints = result.joints
    seen = _SEEN * np.sqrt(joints.area)
    return [
        *_section(
            result,
            "Joints with the most eccentric resultants",
            np.where(joints.pressed, joints.kern, -np.inf),
            _KERN,
        ),
        *_section(result, "Joints that slid most", np.where(joints.sliding > seen, joints.sliding, -np.inf)),
        *_section(
            result, "Joints that opened most", np.where(joints.opening > seen, joints.opening, -np.inf)
        ),
    ]


def _section(result: Result, title: str, order: Array, words: str = "") -> list[str]:
    """A table of the ten joints that come first in an order; nothing where there is none but -inf."""
    first = [int(number) for number in np.argsort(-order, kind="stable")[:10] if np.isfinite(order[number])]
    if not first:
        return []
    joints, codes = result.joints, [body.code for body in result.bodies]
    rows = [
        (
            " – ".join(codes[body] for body in joints.bodies[number]),
            ratio(float(joints.kern[number])),
            ratio(float(joints.edge[number])),
            kilopascals(float(joints.pressure_mean[number])),
            millimetres(float(joints.opening[number])),
            millimetres(float(joints.sliding[number])),
            ratio(float(joints.friction_use[number])),
        )
        for number in first
    ]
    head = (
        "Joint",
        "Over the kern",
        "Over the edge",
        "Pressure, mean",
        "Opening",
        "Sliding",
        "Friction used",
    )
    return [f"<h2>{title}</h2>", words, table(rows, head)]
