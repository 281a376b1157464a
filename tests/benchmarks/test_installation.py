"""Measurement of an installed wheel: packages of the base, and the tables of the page."""

import sys
import zipfile

import pytest

from tests.paths import ROOT

if sys.platform == "win32":
    pytest.skip("processor times of processes are read as on Unix", allow_module_level=True)

from benchmarks.first_use import MATRIX
from benchmarks.installation import Use, _again, _timed, _written, base_packages, tables


def test_the_base_has_what_was_asked_for_and_nothing_of_the_extras():
    sizes = base_packages()
    assert {"gmsh", "meshio", "pyvista", "vtk", "numba", "moma-masonry"} <= set(sizes)
    assert not {"fastapi", "pytest", "sphinx", "ezdxf"} & set(sizes)
    assert sizes["numpy"] > 10.0  # megabytes


def test_the_matrix_has_every_engine_and_sample():
    words = " ".join(MATRIX)
    for name in (
        *("arch", "window", "wall", "tower", "rubble-wall", "assess", "diagnose", "pushover", "trade"),
        *("check", "propose infill --record", "biaxial"),
    ):
        assert name in words


def test_a_command_that_fails_is_not_measured(tmp_path):
    call = [sys.executable, "-c", "import sys; sys.exit('no stone')"]
    with pytest.raises(RuntimeError, match="ended with 1: no stone"):
        _timed(call, tmp_path, {})
    assert _timed(call, tmp_path, {}, must=False) > 0.0


@pytest.mark.parametrize("line", MATRIX)
def test_a_command_is_repeated_beside_its_first_results(line):
    words = line.split()
    again = _again(words)
    if words[0] in ("ingest", "sample", "trade"):
        assert again[:-1] == words[:-1]
        assert again[-1] != words[-1]
    else:
        assert again[: len(words)] == words


def test_the_tables_stand_between_their_marks(tmp_path):
    wheel = tmp_path / "moma-1-cp311-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("a/__pycache__/k.nbc", b"0")
        archive.writestr("a/k.py", b"")
    uses = [Use("run arch.toml --db x", 2.0, 1.5, 0), Use("assess arch.toml", 9.0, 3.0, 4)]
    text = tables(wheel, 70.0, uses, {"vtk": 590.0, "numpy": 40.0})
    assert "1 compiled kernels, built in 70 s" in text
    assert "2 packages, 630 MB: vtk 590, numpy 40" in text
    assert "| `moma run arch.toml` | 2.0 | 1.5 | 0 |" in text
    page = "before\n<!-- measured -->\nold\n<!-- end -->\nafter\n"
    assert _written(page, text) == f"before\n<!-- measured -->\n{text}<!-- end -->\nafter\n"
    real = (ROOT / "docs/design/first-use.md").read_text(encoding="utf-8")
    assert _written(real, "X") != real
