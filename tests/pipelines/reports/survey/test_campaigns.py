"""Two campaigns told by a report and by the database: one rule, one answer."""

import json
from pathlib import Path

import numpy as np
import pytest

from pipelines.ingest.reading_options import reading_options
from pipelines.reports.survey.campaigns import comparison_lines
from pipelines.reports.survey.study import study_surveys
from tests.moma.commands import invoke

HEAD = "moma-survey 1\nname {name}\nsigma 0.001\nobserver 5 -10 1\ndepth * 0.4 source drilled\n"


def survey(
    path: Path, seed: int, moved: dict[int, tuple[float, float, float]], shift: tuple[float, ...]
) -> Path:
    """Write twelve stones of a course, measured with 1 mm; `shift` is that of the frame."""
    chance, text = np.random.default_rng(seed), HEAD.format(name=path.stem)
    for k in range(12):
        text += f"stone A{k} ashlar course 1\n"
        for word, right, up in (
            *(("vertex", right, up) for right, up in ((0.0, 0.0), (0.5, 0.0), (0.5, 0.3), (0.0, 0.3))),
            *(("point", right, up) for right, up in ((0.1, 0.1), (0.4, 0.1), (0.25, 0.25))),
        ):
            place = np.array([0.6 * k + right, 0.0, up]) + moved.get(k, (0, 0, 0)) + shift
            text += f"  {word} {' '.join(f'{value:.5f}' for value in place + chance.normal(0.0, 1e-3, 3))}\n"
        text += "end\n"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("shift", "codes", "remark"),
    [
        ((0.0, 0.0, 0.0), {"A4"}, ""),
        ((0.012, 0.0, 0.0), set(), "scatter by"),  # along the face: stones cannot be told from their frame
        ((0.0, 0.012, 0.0), {f"A{k}" for k in range(12)}, "the frames of both campaigns differ"),
    ],
    ids=["one frame", "shifted along the wall", "shifted outwards"],
)
def test_a_report_and_the_database_give_the_same_answer(tmp_path, shift, codes, remark):
    first = survey(tmp_path / "first.moma", 1, {}, (0.0, 0.0, 0.0))
    second = survey(tmp_path / "second.moma", 2, {4: (0.0, 0.0, -0.015)}, shift)
    since = study_surveys([second], "moma", reading_options(None, None), since=[first]).since
    assert since is not None
    url = f"sqlite:///{tmp_path}/a.db"
    for words in ([first], [second, "--again"]):
        done = invoke("ingest", *words, "--db", url)
        assert done.exit_code == 0, done.output
    asked = ("query", "entity", "--columns", "code,moved,moved_sigma", "--db", url, "--where")
    done = invoke(*asked, "moved_since('first') is not null", "--json")
    rows = {row["code"]: row for row in json.loads(done.stdout)}
    for stone in since.stones:
        row = rows[stone.code]
        assert row["moved"] == pytest.approx(stone.displacement.distance, rel=1e-6)
        # the report carries the larger of two tilts
        assert row["moved_sigma"] == pytest.approx(stone.displacement.sigma, rel=0.1)
    found = invoke(*asked, "moved_since('first')")
    moved = {stone.code for stone in since.moved}
    assert moved == codes
    assert {word for word in found.output.split() if word in rows} == codes
    for text in ("\n".join(comparison_lines(since)), done.output, found.output):
        assert remark in text
