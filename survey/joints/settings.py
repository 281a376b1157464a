"""Settings of joint closing: criteria of a joint between two surveyed stones, and its treatment."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from ground.settings import Setting
from survey.conventions import ALIKE, JOINT, WIDEST_JOINT


class JointMode(StrEnum):
    """Treatment of the open joints of a survey.

    CLOSE: both stones are extended to the middle of the joint and share its plane (dry joints). MORTAR: likewise, and
    the open width is kept as the thickness of the mortar, which the plane then represents; stones of one leaf that are
    known by their outlines grow to the medial lines between these. AS_SURVEYED: stones keep their measured sides and
    gaps.
    """

    CLOSE = "close"
    MORTAR = "mortar"
    AS_SURVEYED = "as-surveyed"


@dataclass(frozen=True)
class JointSettings:
    """Criteria of a joint, its treatment, and bounds on the displacement of stones."""

    mode: Annotated[
        JointMode,
        Setting(
            "close: neighbours share contact planes; mortar: so too, with the width kept as the mortar's thickness, "
            "and outlines of one leaf grow to meet in its middle; as-surveyed: stones keep their measured sides."
        ),
    ] = JointMode.CLOSE
    max_width: Annotated[
        float,
        Setting(
            "Faces farther apart do not make a joint; mortar between outlines that grow fills what is up to this wide, "
            "or up to four times as wide as their usual joint, and wider places stay open.",
            "m",
            above=0,
        ),
    ] = WIDEST_JOINT
    max_angle: Annotated[
        float, Setting("Faces that open wider do not make a joint.", "°", above=0, below=45)
    ] = math.degrees(ALIKE)
    min_overlap: Annotated[
        float, Setting("Narrowest strip in which two faces must face each other.", "m", at_least=0)
    ] = JOINT
    straightness: Annotated[
        float,
        Setting(
            "Largest distance of a sound corner from its joint that still counts as plane; "
            "a bed that is less straight is bent.",
            "m",
            above=0,
            at_most=0.1,
        ),
    ] = 0.02
    max_displacement: Annotated[
        float, Setting("Largest distance by which closing may move a corner.", "m", above=0)
    ] = 0.08
    grow: Annotated[
        bool | None,
        Setting(
            "With mortar, stones of one leaf grow to the medial lines between their outlines, however irregular these "
            "are; if not given, those that came in as outlines without a cloud."
        ),
    ] = None
    margin: Annotated[
        float,
        Setting(
            "Width of the mortar around the outlines of a leaf whose size was not stated when it was taken in.",
            "m",
            at_least=0,
        ),
    ] = 0.0
    mortar_density: Annotated[
        float | None,
        Setting(
            "Density of the mortar that grown stones take in; if not given, that of the stone.",
            "kg/m³",
            above=0,
        ),
    ] = None
