"""Pictures and figures where their packages are absent or cannot load: what is missing is named."""

import builtins
import json
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError

import pytest

from ground.errors import MissingLibraryError
from moma.cli.console import reporting
from pipelines.draw.elevations.sheet import require_figures
from pipelines.draw.offscreen.jobs import run_job
from pipelines.draw.pictures import draw_apart
from pipelines.run import record
from tests.moma.commands import answer, invoke, prints
from tests.paths import SAMPLE
from tests.pipelines.scenes import TWO_COURSES, small_geology


@pytest.mark.parametrize("state", ["absent", "unloadable"])
def test_the_process_that_draws_names_what_is_missing(state, monkeypatch, capsys, tmp_path):
    if state == "absent":
        monkeypatch.setitem(sys.modules, "pyvista", None)
    else:
        monkeypatch.delitem(sys.modules, "pyvista", raising=False)
        (tmp_path / "pyvista.py").write_text("raise ImportError('libGL.so.1: not there')", encoding="utf-8")
        monkeypatch.syspath_prepend(str(tmp_path))
    assert run_job(object, lambda *_: None) == 3
    assert ("pyvista" if state == "absent" else "libGL.so.1") in capsys.readouterr().out


@pytest.fixture
def without(monkeypatch):
    """A function after which a package, and all that is in it, cannot be imported."""
    true = builtins.__import__

    def block(package):
        def refuse(name, *arguments, **options):
            if name.partition(".")[0] == package:
                raise ModuleNotFoundError(f"No module named {package!r}", name=package)
            return true(name, *arguments, **options)

        monkeypatch.setattr(builtins, "__import__", refuse)

    return block


@dataclass
class Nothing:
    """What is drawn."""


@pytest.mark.draws
@pytest.mark.parametrize(
    ("package", "remedy"),
    [("pyvista", "pyvista"), ("vtkmodules.vtkCommonCore", "vtk"), ("matplotlib", "matplotlib")],
)
def test_pictures_name_the_package_that_is_absent(package, remedy, monkeypatch, tmp_path):
    (tmp_path / "drawing.py").write_text(
        f"import sys; sys.stdin.readline(); print(\"No module named '{package}'\"); sys.exit(3)",
        encoding="utf-8",
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(
        MissingLibraryError, match=rf"VTK cannot be loaded: .*{package}.*; pip install {remedy}$"
    ):
        draw_apart("drawing", Nothing(), [])


def test_figures_are_refused_before_the_work(without):
    require_figures()
    without("matplotlib")
    with pytest.raises(
        MissingLibraryError, match=r"figures: .* matplotlib, which is not installed; pip install"
    ):
        require_figures()


@pytest.mark.parametrize("arguments", [
    ("geology", "biaxial", "{geology}/biaxial.toml", "--out", "out"),
    ("survey-report", str(SAMPLE / "window.moma"), "--out", "out"),
])  # fmt: skip
def test_a_command_that_wants_figures_names_matplotlib_and_leaves_nothing(
    arguments, without, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    small_geology(tmp_path / "geology")
    without("matplotlib")
    done = invoke(*(one.format(geology=tmp_path / "geology") for one in arguments))
    assert done.exit_code == 1
    assert done.stderr.splitlines()[-1].endswith("pip install matplotlib")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_run_without_matplotlib_and_gmsh_keeps_its_results_and_says_what_is_missing(
    without, tmp_path, monkeypatch
):
    def version(package):
        if package == "gmsh":
            raise PackageNotFoundError(package)
        return "1.0"

    monkeypatch.setattr(record, "version", version)
    url = f"sqlite:///{tmp_path}/window.db"
    prints("ingest", SAMPLE / "window.moma", "--db", url)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    without("matplotlib")
    done = invoke("run", scene, "--db", url, "--out", tmp_path / "out", "--json")
    said = json.loads(done.stdout)
    assert any(
        "no curve of the history" in one and "pip install matplotlib" in one for one in said["warnings"]
    )
    assert "<h2>History" not in (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert answer("runs", "1", "--db", url)["versions"]["gmsh"] == "not installed"


SCENE = (
    TWO_COURSES
    + """\
[contact]
friction = 0.55
[time]
duration = 0.002
[output]
pictures = []
"""
)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            ModuleNotFoundError(name="clarabel"),
            "the package clarabel, which is not installed; pip install clarabel",
        ),
        (
            ModuleNotFoundError(name="PIL.Image"),
            "the package pillow, which is not installed; pip install pillow",
        ),
        (
            ImportError("libhdf5.so: not there", name="h5py"),
            "h5py, which cannot be loaded: libhdf5.so: not there; pip",
        ),
        (ImportError("no name x in it", name="pipelines.run"), "unexpected ImportError"),
    ],
)
def test_any_other_package_is_named_where_a_command_needs_it(error, said, capsys):
    @reporting
    def command():
        raise error

    with pytest.raises(Exception):  # noqa: B017, PT011 - typer's own
        command()
    assert said in capsys.readouterr().err
