"""survey.json: the survey report for programs."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.reports.survey.study import SurveyFile, SurveyStudy
from survey.quality.courses import CourseLine
from survey.quality.departures.beds import WallBeds
from survey.quality.departures.faces import WallFace
from survey.quality.facades import Facade
from survey.quality.masonry.walls import MasonryQuality
from survey.quality.precision import StoneQuality, SurveyQuality
from survey.quality.remeasure import Remeasure


def survey_json(study: SurveyStudy, version: str) -> dict[str, Any]:
    """Describe the survey as a whole: metres, degrees where a name says so, null where unknown."""
    content = {
        "survey": study.name,
        "version": version,
        "warnings": study.warnings,
        "inputs": [_file(file) for file in study.files],
        "quality": _quality(study.quality, len(study.rejects)),
        "facades": [_facade(facade) for facade in study.facades],
        "kinds": [_record(one) for one in study.usual.values()],
        "since": None if study.since is None else study.since.as_values(),
    }
    plain: dict[str, Any] = _plain(content)
    return plain


def write_survey_json(path: Path, study: SurveyStudy, content: Mapping[str, Any]) -> None:
    """Write survey.json: the survey as a whole, then its parts one per line, which keeps memory low.

    Parameters
    ----------
    path : survey.json
    study : with the parts
    content : result of `survey_json`, with additions if wanted
    """
    parts: dict[str, Iterable[dict[str, Any]]] = {
        "courses": (_course(course, study.beds) for course in study.courses),
        "course_heights": map(_record, study.course_heights),
        "contradictions": map(_record, study.contradictions),
        "beds": map(_beds, study.beds),
        "faces": (_face(face, study.stones) for face in study.faces),
        "depths": map(_record, study.depths),
        "masonry": (_masonry(stone, study.stones) for stone in study.masonry),
        "measure_again": map(_remeasure, study.again.rows),
        "measure_again_left": ({"text": text} for text in study.again.left),
        "remeasure": map(_remeasure, study.remeasures),
        "rejects": (
            {"code": reject.code, "line": _line(reject.spans), "reason": str(reject.error)}
            for reject in study.rejects
        ),
        "stones": _stones(study),
    }
    with path.open("w", encoding="utf-8") as out:
        out.write(json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False).removesuffix("\n}"))
        for name, rows in parts.items():
            out.write(f',\n "{name}": [')
            for number, row in enumerate(rows):
                out.write(",\n  " if number else "\n  ")
                out.write(json.dumps(_plain(row), ensure_ascii=False, allow_nan=False))
            out.write("\n ]")
        out.write("\n}\n")


def _stones(study: SurveyStudy) -> Iterator[dict[str, Any]]:
    deviations = {deviation.code: deviation for deviation in study.deviations}
    facade_of = {i: facade.name for facade in study.facades for i in facade.members.tolist()}
    reasons: dict[str, list[str]] = {}
    for remeasure in study.remeasures:
        if remeasure.code is not None:
            reasons.setdefault(remeasure.code, []).append(remeasure.reason)
    for i, stone in enumerate(study.stones):
        yield _stone(stone, facade_of.get(i), deviations.get(stone.code), reasons.get(stone.code, []))


def _file(file: SurveyFile) -> dict[str, Any]:
    control = None
    if (transform := file.transform) is not None:
        control = {
            "scale": transform.scale,
            "sigma0": transform.sigma0,
            "redundancy": transform.redundancy,
            "rejected": transform.rejected,
            "points": [
                {"name": name, "residual": residual, "standardised": test, "limit": limit}
                for name, residual, test, limit in zip(
                    transform.names,
                    transform.residuals,
                    transform.standardised,
                    transform.limits,
                    strict=True,
                )
            ],
        }
    return {
        "path": file.head.path,
        "survey": file.head.name,
        "stones": file.stones,
        "rejects": file.rejects,
        "stations": [{"name": station.name, "position": station.position} for station in file.head.stations],
        "control": control,
    }


def _quality(quality: SurveyQuality, rejects: int) -> dict[str, Any]:
    values = _record(quality)
    residuals = values.pop("residuals")
    return {**values, "rejects": rejects, "residuals": _record(residuals)}


def _facade(facade: Facade) -> dict[str, Any]:
    along, up, outward = facade.frame.axes
    return {
        "name": facade.name,
        "azimuth": facade.azimuth,
        "area": facade.area,
        "stones": len(facade.members),
        "origin": facade.frame.origin,
        "along": along,
        "up": up,
        "outward": outward,
    }


def _course(line: CourseLine, walls: Sequence[WallBeds]) -> dict[str, Any]:
    values = _record(line)
    covariance = values.pop("covariance")
    corners = [values.pop(name) for name in ("codes", "along", "height", "sigma", "deviations")]
    values["level_sigma"] = math.sqrt(covariance[0, 0])
    values["slope_sigma"] = line.slope_sigma
    values["slope_degrees"] = None if line.slope is None else math.degrees(math.atan(line.slope))
    values["span"] = line.span
    values["worst"] = {"stone": line.worst[0], "deviation": line.worst[1]}
    values["finding"] = finding_of(line, walls)
    values["corners"] = dict(zip(("stone", "along", "height", "sigma", "deviation"), corners, strict=True))
    return values


def _beds(wall: WallBeds) -> dict[str, Any]:
    values = _record(wall)
    values["movements"] = [
        {
            **_record(movement),
            "text": movement.text,
            "dating": movement.dating,
            "courses": [
                {"course": number, "amount": amount, "sigma": sigma}
                for number, (amount, sigma) in movement.courses.items()
            ],
        }
        for movement in wall.movements
    ]
    values["odd"] = [_record(one) for one in wall.odd]
    values["excluded_in"] = [{"course": number, "amount": one} for number, one in wall.excluded_in.items()]
    return values


def _face(wall: WallFace, stones: Sequence[StoneQuality]) -> dict[str, Any]:
    values = _record(wall)
    plane, plumb = values.pop("plane"), values.pop("plumb")
    values["stones"] = [
        {"code": stones[i].code, "plane": before, "plumb": upright}
        for i, before, upright in zip(wall.stones.tolist(), plane.tolist(), plumb.tolist(), strict=True)
    ]
    values["movements"] = [{**_record(movement), "text": movement.text} for movement in wall.movements]
    values["odd"] = [{**_record(stone), "text": stone.text} for stone in wall.odd]
    return values


def _masonry(wall: MasonryQuality, stones: Sequence[StoneQuality]) -> dict[str, Any]:
    values = _record(wall)
    values["stones"] = [stones[i].code for i in wall.stones.tolist()]
    values["grades"] = {
        name: {"grade": grade.words, "chances": grade.chances, "text": grade.text}
        for name, grade in wall.grades.items()
    }
    return {**values, "categories": wall.categories, "strengths": wall.strengths}


def _remeasure(remeasure: Remeasure) -> dict[str, Any]:
    return {**_record(remeasure), "urgency": remeasure.urgency.name.lower()}


def finding_of(line: CourseLine, walls: Sequence[WallBeds]) -> str:
    """Return the verdict on a course, which its wall gives."""
    own = (wall for wall in walls if (wall.facade, wall.zone) == (line.facade, line.zone))
    return next((one.finding(line.course) for one in own), "not tested")


def _stone(stone: StoneQuality, facade: str | None, deviation: Any, reasons: list[str]) -> dict[str, Any]:
    left = ("outline", "corner_sigma", "standardised", "worn_corners")
    values = {name: getattr(stone, name) for name in StoneQuality.__slots__ if name not in left}
    values["facade"] = facade
    usual = ("length", "height", "length_score", "height_score")
    values["deviation"] = None if deviation is None else {name: getattr(deviation, name) for name in usual}
    values["remeasure"] = reasons
    return values


def _record(value: Any) -> dict[str, Any]:
    """Return the fields of a frozen dataclass; nested dataclasses stay as they are."""
    return {name: getattr(value, name) for name in value.__dataclass_fields__}


def _line(spans: tuple[range, ...]) -> int | None:
    return spans[0].start if spans else None


def _plain(value: Any) -> Any:
    """Convert values to those of JSON; NaN and infinities become null."""
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, np.ndarray) and value.dtype.kind == "f" and np.isfinite(value).all():
        return value.tolist()
    if isinstance(value, np.ndarray | tuple | list):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
