"""Settings of joint closing: criteria of a joint between two surveyed stones, and its treatment."""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["JointMode", "JointSettings"]


class JointMode(StrEnum):
    """Treatment of the open joints of a survey.

    CLOSE: both stones are extended to the middle of the joint and share its plane (dry joints). MORTAR: likewise, and
    the open width is kept as the thickness of the mortar, which the plane then represents. AS_SURVEYED: stones keep
    their measured sides and gaps.
    """

    CLOSE = "close"
    MORTAR = "mortar"
    AS_SURVEYED = "as-surveyed"


@dataclass(frozen=True)
class JointSettings:
    """Criteria of a joint, its treatment, and bounds on the displacement of stones.

    Attributes
    ----------
    mode : treatment of joints
    max_width : largest distance of faces that touch [m]
    max_angle : largest opening of faces that face each other [degrees]
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
