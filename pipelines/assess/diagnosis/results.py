"""Files of a diagnosis: JSON, tables, elevations of measured beside simulated bed lines, and the best scene."""

import csv
import math
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ground.toml.writer import toml_text
from pipelines.assess.diagnosis.dating import Dating
from pipelines.assess.diagnosis.file import DiagnosisFile
from pipelines.assess.diagnosis.measurements import Measurements
from pipelines.assess.diagnosis.ranking import Ranked, verdict
from pipelines.assess.diagnosis.search import RECORDS, Case, Fitted
from pipelines.assess.motions import Motions
from pipelines.draw.elevations.movement import draw_bed_movement
from pipelines.reports.movement import write_diagnosis_page
from pipelines.reports.page.surveys import bed_lines, survey_model
from pipelines.results.folder import source_of
from pipelines.results.summary import as_json
from pipelines.results.table_csv import inert
from pipelines.run.record import versions
from survey.quality.departures.beds import measure_beds
from survey.quality.movement import CourseMovement, compare_courses

_BEST = "best.toml"  # name of the scene

_HYPOTHESIS = "rank hypothesis stood chi2 dof probability aicc amplitude unit value low high"  # columns

INDEX = "diagnosis.json"
"""Index of the results of a diagnosis."""


def write_diagnosis(
    folder: Path,
    file: DiagnosisFile,
    cases: tuple[Case, ...],
    measurements: Measurements,
    done: Fitted,
    dating: Dating | None,
    cautions: tuple[str, ...],
) -> dict[str, Any]:
    """Write all files into an empty folder; return the contents of diagnosis.json.

    Parameters
    ----------
    folder : that is empty
    file, cases : what was asked, and the hypotheses at all times
    measurements, done : the survey, and the fits
    dating : None if it is not dated
    cautions : cases that were not tried, each with its reason
    """
    best = done.ranking.hypotheses[0]
    motions = done.motions[best.name, best.stood]
    courses = compare_courses(
        measure_beds(measurements.stones, measurements.facades)[0], motions.displacement
    )
    _write_hypotheses(folder / "hypotheses.csv", done)
    _write_stones(folder / "stones.csv", courses)
    _draw(folder, courses)
    case = next(case for case in cases if (case.hypothesis.name, case.stood) == (best.name, best.stood))
    write_best(folder, file, case, best)
    summary = _summary(file, measurements, done, dating)
    summary["cautions"] += cautions
    summary["inputs"] = {title: list(lines) for title, lines in measurements.inputs.items()}
    summary["source"] = source_of([file.document.path], folder)
    lines = bed_lines(courses, {facade.name: facade.frame.axes[2] for facade in measurements.facades})
    model = survey_model(
        best.title, measurements.stones, moved=motions.displacement, lines=lines, colour="course"
    )
    write_diagnosis_page(folder / "report.html", Path(file.scene_path).stem, summary, model)
    summary["files"] = sorted([INDEX, *(entry.name for entry in folder.iterdir())])
    (folder / INDEX).write_text(as_json(summary), encoding="utf-8")
    return summary


def _summary(
    file: DiagnosisFile, measurements: Measurements, done: Fitted, dating: Dating | None
) -> dict[str, Any]:
    ranking, deformation = done.ranking, measurements.deformation
    laid = "with a batter" if file.battered else "plumb"
    tolerance = f"level within {1e3 * file.level_tolerance:g} mm/m" if file.level_tolerance else "level"
    return {
        "verdict": verdict(ranking),
        "dating": None
        if dating is None
        else {
            "verdict": dating.verdict,
            "shares": [
                {"phase": share.phase, "value": share.value, "sigma": share.sigma} for share in dating.shares
            ],
            "evidence": list(dating.evidence),
        },
        "cautions": [
            f"courses are assumed to have been laid {tolerance}, and faces {laid}",
            "each run begins with the stones as they are now, and its movement alone is compared"
            + ", counted from where the scene rests without any cause" * file.from_rest,
        ],
        "hypotheses": [
            _told(hypothesis, ranking.hypotheses[0]) for hypothesis in (*ranking.hypotheses, ranking.still)
        ],
        "not_told_apart": [rival.title for rival in ranking.rivals],
        "scatter": {
            " ".join(filter(None, wall)): {"beds": value} for wall, value in deformation.scatter.items()
        },
        "freedom": deformation.freedom,
        "groups": _groups(measurements, done),
        "runs": done.runs,
        "cpu": done.cpu,
        "versions": dict(versions()),
    }


def _told(ranked: Ranked, best: Ranked) -> dict[str, Any]:
    return {
        "name": ranked.name,
        "stood": list(ranked.stood),
        "chi2": ranked.fit.chi2 if len(ranked.fit.residuals) else None,
        "dof": ranked.dof,
        "probability": ranked.probability,
        "explains": ranked.explains,
        "aicc": _finite(ranked.aicc),
        "behind": _finite(ranked.aicc - best.aicc),
        "amplitudes": [
            {
                "name": estimate.name,
                "unit": estimate.unit,
                "value": estimate.value,
                "low": _finite(estimate.low),
                "high": _finite(estimate.high),
                "at_bound": estimate.at_bound,
                "run_sigma": _finite(estimate.run_sigma),
            }
            for estimate in ranked.estimates
        ],
        "covariance": [[_finite(value) for value in row] for row in ranked.fit.covariance.tolist()],
        "remarks": list(ranked.remarks),
        "turns": ranked.fit.turns,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _groups(measurements: Measurements, done: Fitted) -> list[dict[str, Any]]:
    """Return χ² of each course and wall: of the best hypothesis, and if nothing had moved."""
    best = done.ranking.hypotheses[0]
    still, motions = Motions({}, {}), done.motions[best.name, best.stood]
    return [
        {
            "facade": group.facade,
            "zone": group.zone,
            "quantity": group.quantity,
            "course": group.course,
            **{
                name: _square(group.residuals(by.displacement))
                for name, by in (("chi2", motions), ("chi2_still", still))
            },
            "dof": group.dof,
        }
        for group in measurements.deformation.groups
    ]


def _square(residuals: Any) -> float:
    return float(residuals @ residuals)


def _write_hypotheses(path: Path, done: Fitted) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(_HYPOTHESIS.split())
        for number, hypothesis in enumerate((*done.ranking.hypotheses, done.ranking.still), start=1):
            head = [
                number,
                hypothesis.name,
                " ".join(hypothesis.stood),
                hypothesis.fit.chi2,
                hypothesis.dof,
                hypothesis.probability,
                hypothesis.aicc,
            ]
            for estimate in hypothesis.estimates:
                table.writerow(
                    [*head, estimate.name, estimate.unit, estimate.value, estimate.low, estimate.high]
                )
            if not hypothesis.estimates:
                table.writerow([*head, "", "", "", "", ""])


def _write_stones(path: Path, courses: tuple[CourseMovement, ...]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["stone", "facade", "course", "sag_measured", "sag_simulated", "sag_sigma"])
        for line in courses:
            for code, stone in line.stones.items():
                table.writerow(
                    [
                        inert(code),
                        line.line.facade,
                        line.line.course,
                        stone.measured,
                        stone.simulated,
                        stone.sigma,
                    ]
                )


def _draw(folder: Path, courses: tuple[CourseMovement, ...]) -> None:
    """Draw the bed lines of each wall, measured and simulated by the best hypothesis."""
    walls: dict[str, list[CourseMovement]] = {}
    for course in courses:
        walls.setdefault(course.line.facade, []).append(course)
    for number, lines in enumerate(walls.values(), start=1):
        draw_bed_movement(folder / f"beds-{number}.png", lines)


def write_best(folder: Path, file: DiagnosisFile, case: Case, best: Ranked) -> None:
    """Write the scene with the best hypothesis, and copies of the records and tables that it names.

    Parameters
    ----------
    folder : that is empty of files of these names
    file : for the place of the scene, beside which they lie
    case, best : the hypothesis, and its amplitudes
    """
    copies = _Copies(Path(file.scene_path).parent, folder)
    scene = copies.named(case.scene(file, best.fit.amplitudes))
    heading = f"# {best.title}: the amplitudes that explain best\n"
    if file.from_rest:
        heading += "# Movements were counted from where the scene rests without this cause.\n"
    (folder / _BEST).write_text(heading + toml_text(scene), encoding="utf-8")


class _Copies:
    """Copies of the files that a scene names, each under a name of its own.

    Parameters
    ----------
    source : folder of the scene
    target : of the copies
    """

    def __init__(self, source: Path, target: Path) -> None:
        self._source, self._target = source, target
        self._names: dict[Path, str] = {}

    def named(self, content: Any) -> Any:
        """Return part of a scene with the names of the copies."""
        if isinstance(content, list):
            return [self.named(entry) for entry in content]
        if not isinstance(content, Mapping):
            return content
        names = RECORDS if content.get("type") == "ground_motion" else ("file",)
        return {
            key: self._copied(value) if key in names and isinstance(value, str) else self.named(value)
            for key, value in content.items()
        }

    def _copied(self, name: str) -> str:
        path = (self._source / name).resolve()
        if path not in self._names:
            copy, number = path.name, 1
            while copy in self._names.values() or (self._target / copy).exists():
                number += 1
                copy = f"{path.stem}-{number}{path.suffix}"
            shutil.copyfile(path, self._target / copy)
            self._names[path] = copy
        return self._names[path]
