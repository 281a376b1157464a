"""What counts as a joint between two surveyed stones, and what becomes of it."""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["JointMode", "JointSettings"]


class JointMode(StrEnum):
    """What becomes of the open joints of a survey.

    CLOSE: both stones are led to the middle of the joint and share its plane (dry joints). MORTAR: so too, and the
    width that was open is kept as the thickness of the mortar, which the plane then stands for. AS_SURVEYED: stones
    keep their measured sides, gaps and all.
    """

    CLOSE = "close"
    MORTAR = "mortar"
    AS_SURVEYED = "as-surveyed"


@dataclass(frozen=True)
class JointSettings:
    """What counts as a joint, what becomes of it, and how far closing it may move a stone.

    Attributes
    ----------
    mode : what becomes of joints
    max_width : faces farther apart do not touch [m]
    max_angle : faces that open wider do not face each other [degrees]
    min_overlap : narrowest strip in which two faces must face each other [m]
    straightness : largest distance of a sound corner from its side of a joint that is taken as one plane [m]
    max_displacement : largest distance by which a corner may move [m]
    """

    mode: JointMode = JointMode.CLOSE
    max_width: float = 0.05
    max_angle: float = 20.0
    min_overlap: float = 0.01
    straightness: float = 0.02
    max_displacement: float = 0.08
