"""Report of a run: it explains results whose numbers are known."""

import base64
from dataclasses import replace

from mechanics.scene.scene import Fidelity
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
    assert "<script" not in (tmp_path / "report.html").read_text(encoding="utf-8").lower()
