"""Report of a run: it explains results whose numbers are known."""

import base64
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Fidelity
from pipelines.draw.pictures import _heading
from pipelines.reports.html import kilonewtons, kilopascals, megapascals, millimetres
from pipelines.reports.run import write_report
from pipelines.results.stone_values import stone_results
from pipelines.results.summary import summarise
from tests.pipelines.reports.page import Page
from tests.pipelines.results_by_hand import LIMESTONE, deformable_body, result_of, rigid_body


def test_the_report_explains_the_run_and_needs_no_other_file(mixed, tmp_path):
    pixel = base64.b64decode(
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
    )
    (tmp_path / "von_mises.png").write_bytes(pixel)
    summary = summarise(mixed, version="1.2", seconds={"solve": 1.0})
    write_report(tmp_path / "report.html", mixed, summary, stone_results(mixed), ["a <warning>"])
    page = Page(tmp_path / "report.html")
    text = " ".join(page.text)
    for words in ("It stands", "D1", "2.0000 MPa", "20.01 kN", "a <warning>", "not known", "4.0e-04"):
        assert words in text
    assert page.sources
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)


def test_the_report_names_the_worst_stones_and_joints(strong, tmp_path):
    summary = summarise(strong, version="1.2", seconds={})
    write_report(tmp_path / "report.html", strong, summary, stone_results(strong), [])
    words = Page(tmp_path / "report.html").text
    place = words.index("Stones nearest to their strength")
    assert words[place + 7 : place + 10] == ["D1", "0.5", words[place + 9]]
    place = words.index("Joints with the most eccentric resultants")
    assert words[place + 9 : place + 12] == ["D1 – top", "1.2", "0.4"]
    assert "10.0 %" in words  # error
    assert words[words.index("Joints that slid most") + 8] == "D1 – top"
    assert words[words.index("Joints that opened most") + 8] == "D1 – top"


def row(words, title, head, first):
    """The first row of the table under a title, by the heads of its columns."""
    start = words.index(head, words.index(title))
    end = words.index(first, start)
    return dict(zip(words[start:end], words[end : 2 * end - start], strict=True))


def test_the_report_gives_every_number_in_its_unit_under_its_head(tmp_path):
    """A stone between 0.5 MPa of tension and 1.5 MPa of compression; joints of 1 m² that bear 3 kN and 800 N."""
    strong = replace(LIMESTONE, tensile_strength=1e6, compressive_strength=4e6)
    bodies = [
        rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
        deformable_body(
            "D1", (0, 0, 1), (1, 1, 3), lambda p: 1e6 * (p[:, 2] - 1.5), 0.5, (0, 0, -0.002), strong
        ),
        rigid_body("top", (0, 0, 3), (1, 1, 4), shift=(0, 0.003, -0.004)),
    ]
    pairs, forces = ((1, 0), (2, 1)), ((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0))
    result = result_of(bodies, pairs=pairs, forces=forces, material=strong)
    stones = stone_results(result)
    summary = summarise(result, version="1.2", seconds={"solve": 1.5})
    write_report(tmp_path / "report.html", result, summary, stones, [])
    words = Page(tmp_path / "report.html").text
    for name, value in (
        ("Weight carried", "20.00 kN"),
        ("Reaction of the supports", "20.01 kN"),
        ("Largest displacement", "5 mm"),
        ("Von Mises stress, largest", "1.5000 MPa in D1, error of its stress 10.0 %"),
        ("Overlap", "2.0e-06"),
        ("Energy", "not known"),
        ("Unsolved steps", "1"),
        ("solve", "1.50 s"),
    ):
        assert words[words.index(name) + 1] == value
    stone = row(words, "Stones nearest to their strength", "Stone", "D1")
    assert stone["Stress over strength"] == "0.5"
    assert stone["Largest tension"] == "0.5000 MPa"
    assert stone["Largest compression"] == "-1.5000 MPa"
    assert stone["Mean pressure"] == "0.1667 MPa"
    upper = row(words, "Joints with the most eccentric resultants", "Joint", "D1 – top")
    assert (upper["Over the kern"], upper["Over the edge"]) == ("1.2", "0.4")
    assert (upper["Opening"], upper["Sliding"], upper["Friction used"]) == ("0.1 mm", "2 mm", "0.5")
    assert upper["Mean pressure"] == "0.8 kPa"


@pytest.mark.parametrize(
    ("written", "text"),
    [
        (kilopascals(9.6e-12), "0 kPa"),
        (kilopascals(-3e-9), "0 kPa"),
        (kilopascals(0.5), "0.0005 kPa"),
        (millimetres(-6e-17), "0 mm"),
        (millimetres(2e-9), "2e-06 mm"),
        (kilonewtons(-4.8e-10), "0.00 kN"),
        (megapascals(-1e-9), "0.0000 MPa"),
    ],
)
def test_what_rounds_to_nothing_is_nothing(written, text):
    assert written == text


def test_the_report_lists_the_worst_first(tmp_path):
    """Of three joints the highest has slid and opened most, and the middle one bears nothing."""
    stones = [rigid_body(f"S{k}", (0, 0, k), (1, 1, k + 1)) for k in range(4)]
    pairs, forces = [(1, 0), (2, 1), (3, 2)], np.tile([0.0, 0.0, 900.0], (3, 1))
    result = result_of(stones, pairs=pairs, forces=forces)
    kern = np.array([0.6, np.nan, 1.8])
    result = replace(result, joints=replace(result.joints, kern=kern))
    summary = summarise(result, version="1.2", seconds={})
    write_report(tmp_path / "report.html", result, summary, stone_results(result), [])
    words = Page(tmp_path / "report.html").text
    place = [
        words.index(f"Joints {what}") for what in ("with the most eccentric resultants", "that slid most")
    ]
    place += [words.index("Joints that opened most"), words.index("History")]
    joints = [
        [word for word in words[start:end] if word.startswith("S") and " – S" in word]
        for start, end in pairwise(place)
    ]
    assert joints == [
        ["S2 – S3", "S0 – S1"],
        ["S2 – S3", "S1 – S2", "S0 – S1"],
        ["S2 – S3", "S1 – S2"],  # the lowest has not opened
    ]


def test_stress_at_a_corner_does_not_lead(tmp_path):
    """D1 has a peak of 9 MPa in a corner, D2 2 MPa all over: the volume decides the order, the corner stands behind."""
    bodies = [
        deformable_body("D1", (0, 0, 0), (1, 1, 1), lambda p: np.where(p.sum(axis=1) > 2.99, 9e6, 1e6), 0.1),
        deformable_body("D2", (2, 0, 0), (3, 1, 1), lambda p: 2e6 * np.ones(len(p)), 0.5),
    ]
    result = result_of(bodies, pairs=(), forces=())
    summary = summarise(result, version="1.2", seconds={})
    write_report(tmp_path / "report.html", result, summary, stone_results(result), [])
    words = Page(tmp_path / "report.html").text
    leads, behind = (
        words.index(f"Von Mises stress, {what}") for what in ("exceeded in 1 % of the volume", "largest")
    )
    assert leads < behind
    assert words[leads + 1] == "2.0000 MPa"
    assert words[behind + 1].startswith("9.0000 MPa in D1")
    start = words.index("Most stressed stones")
    assert words.index("D2", start) < words.index("D1", start)
    first, second = (
        "1 % of the volume exceeds 2 MPa",
        "at a corner up to 9 MPa, in D1 (error of its stress 10 %)",
    )
    assert _heading(result, "von_mises")[-1] == f"{first}; {second}"


def test_the_report_lists_the_most_stressed_stones_first(tmp_path):
    """Pulled by 1, 3 and 2 MPa; the error of their stress grows the other way round."""
    bodies = [
        deformable_body(
            f"D{k}", (2 * k, 0, 0), (2 * k + 1, 1, 1), lambda p, k=k: -1e6 * k * p[:, 2], 0.5, error=0.5 / k
        )
        for k in (1, 3, 2)
    ]
    result = result_of(bodies, pairs=(), forces=())
    summary = summarise(result, version="1.2", seconds={})
    write_report(tmp_path / "report.html", result, summary, stone_results(result), [])
    words = Page(tmp_path / "report.html").text
    titles = (
        "Most stressed stones",
        "Stones with the largest tension",
        "Stones with the least certain stress",
    )
    place = [words.index(title) for title in (*titles, "History")]
    listed = [[word for word in words[a:b] if word in ("D1", "D2", "D3")] for a, b in pairwise(place)]
    assert listed == [["D3", "D2", "D1"], ["D3", "D2", "D1"], ["D1", "D2", "D3"]]


@pytest.mark.parametrize(
    ("outcome", "lead"),
    [
        ("equilibrium", "It stands"),
        ("moving", "still moving"),
        ("collapsed", "It falls"),
        ("undecided", "Nothing can be said"),
        ("interrupted", "interrupted before its time"),
    ],
)
def test_the_report_begins_with_the_outcome(tmp_path, outcome, lead):
    result = result_of([rigid_body("a", (0, 0, 0), (1, 1, 1))], Outcome(outcome), pairs=(), forces=())
    summary = summarise(result, version="1.2", seconds={})
    write_report(tmp_path / "report.html", result, summary, stone_results(result), [])
    assert lead in " ".join(Page(tmp_path / "report.html").text[:6])


@pytest.mark.parametrize("caution", ["it is unsound: a hole", "3 of 9 steps were not solved"])
def test_what_may_be_wrong_says_so_in_the_first_line_of_the_report(tmp_path, caution):
    result = result_of([rigid_body("a", (0, 0, 0), (1, 1, 1))], pairs=(), forces=())
    result = replace(result, cautions=(caution, "another"))
    write_report(
        tmp_path / "report.html",
        result,
        summarise(result, version="1.2", seconds={}),
        stone_results(result),
        [],
    )
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    first = text[text.index('<p class="lead open">') :]
    assert f"Caution: {caution}" in first[: first.index("</p>")]
    assert text.count("Caution: another") == 1


def test_the_report_of_a_rigid_collapse_says_so(rigid, tmp_path):
    summary = summarise(rigid, version="1.2", seconds={})
    write_report(tmp_path / "report.html", rigid, summary, stone_results(rigid), [])
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "It falls" in text
    assert "Most stressed" not in text


def test_no_text_of_a_run_becomes_markup(tmp_path):
    """Codes, material, scene, warnings, profile and stages, all named like a script."""
    name = "<script>alert('1')</script>"
    material = replace(LIMESTONE, name=name, tensile_strength=1e6)
    bodies = [
        rigid_body(f"{name} base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
        deformable_body(name, (0, 0, 1), (1, 1, 3), lambda points: 1e6 * points[:, 2], material=material),
    ]
    result = result_of(bodies, name=name)
    profile = {"name": name, "about": name, "settings": {name: name}, "expected": {"p99": {"of": name}}}
    profile["expected"]["p99"] |= {"bound": True, "value": 0.1}
    summary = {**summarise(result, version=name, seconds={name: 1.0}), "profile": profile}
    write_report(tmp_path / "report.html", result, summary, stone_results(result), [name])
    page = Page(tmp_path / "report.html")
    assert "script" not in page.tags
    assert sum("<script>" in text.lower() for text in page.text) >= 12
    page_text = (tmp_path / "report.html").read_text(encoding="utf-8").lower()
    assert page_text.count("<script") == page.scripts
