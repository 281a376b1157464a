import json
from typing import Any

import pytest

from survey.extrusion.depth import depth_for
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.faces.faces import outline_face
from survey.formats.native.reader import read_moma
from survey.joints.close import ClosedStones, close_joints
from survey.records.survey import Survey
from tests.paths import ROOT

SAMPLE = ROOT / "data" / "samples" / "window"


@pytest.fixture(scope="session")
def survey() -> Survey:
    return read_moma(SAMPLE / "window.moma")


@pytest.fixture(scope="session")
def truth() -> dict[str, dict[str, Any]]:
    stones = json.loads((SAMPLE / "truth.json").read_text(encoding="utf-8"))["stones"]
    return {stone["code"]: stone for stone in stones}


@pytest.fixture(scope="session")
def blocks(survey: Survey) -> list[SurveyedBlock]:
    return [
        extrude(outline_face(record, survey.head.viewpoint(None)), depth_for(record, survey.head.depth_rules))
        for record in survey.blocks
    ]


@pytest.fixture(scope="session")
def closed(blocks: list[SurveyedBlock]) -> ClosedStones:
    return close_joints(blocks)
