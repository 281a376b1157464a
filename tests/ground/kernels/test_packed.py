"""Kernels that a wheel carries: where they are used, and that the sample then compiles nothing."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from importlib.metadata import version
from pathlib import Path

import numba
import pytest

from ground.kernels import packed
from tests.paths import ROOT, SAMPLE

TARGET = {"NUMBA_CPU_NAME": "some-level", "NUMBA_CPU_FEATURES": "+one,+two"}
THIS = {"python": sysconfig.get_python_version(), "numba": version("numba"), "environment": TARGET}

COUNTING = """
import json, sys
from moma.cli import app
import mechanics
from numba.core import event

class Compilations(event.Listener):
    names = []
    def on_start(self, event): self.names.append(event.data["dispatcher"].py_func.__qualname__)
    def on_end(self, event): pass

compilations = Compilations()
event.register("numba:compile", compilations)
app(sys.argv[2:], prog_name="moma", standalone_mode=False)
with open(sys.argv[1], "w") as file:
    json.dump({"from": mechanics.__file__, "compiled": compilations.names}, file)
"""


@pytest.fixture
def told(monkeypatch, tmp_path):
    """What numba is told, by its environment, on a processor with features one, two and three."""

    def told(fitting, **environment):
        stored = tmp_path / "packed.json"
        if fitting is not None:
            stored.write_text(json.dumps(fitting), encoding="utf-8")
        monkeypatch.setattr(packed, "_FITTING", stored)
        monkeypatch.setattr(packed, "_features", lambda: {"one", "two", "three"})
        monkeypatch.setattr(os, "environ", environment)
        packed.use_packed_kernels()
        return environment

    return told


@pytest.fixture
def before_numba(monkeypatch):
    monkeypatch.delitem(sys.modules, "numba")
    yield
    sys.modules["numba"] = numba


def test_kernels_that_fit_are_used(told, before_numba):
    assert told(THIS) == TARGET


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"python": "3.1"}, f"are for Python 3.1, here is {THIS['python']}"),
        ({"numba": "0.1.0"}, f"are for numba 0.1.0, here is {THIS['numba']}: pip install numba==0.1.0"),
        ({"environment": TARGET | {"NUMBA_CPU_FEATURES": "+one,+four"}}, "need a processor with four"),
    ],
    ids=["python", "numba", "processor"],
)
def test_kernels_of_another_python_numba_or_processor_are_not_and_one_line_says_why(
    told, before_numba, other, said, capsys
):
    environment = told(THIS | other)
    assert not environment.keys() & TARGET.keys()
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("moma: warning: the kernels of this wheel")
    assert said in line
    # a process that this one starts says it no more
    told(THIS | other, **environment)
    assert capsys.readouterr().err == ""


def test_an_installation_that_is_read_only_says_so_and_compiles(told, before_numba, monkeypatch, capsys):
    monkeypatch.setattr(os, "access", lambda folder, mode: False)
    assert not told(THIS).keys() & TARGET.keys()
    (line,) = capsys.readouterr().err.splitlines()
    assert "read-only" in line
    assert line.endswith("kernels are compiled here, once: moma warm-up")


def test_a_wheel_pins_numba_and_the_source_does_not(tmp_path, monkeypatch):
    backend = importlib.util.spec_from_file_location("backend", ROOT / "wheel_with_kernels.py")
    module = importlib.util.module_from_spec(backend)
    backend.loader.exec_module(module)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    module._pin_numba()
    required = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    assert [one for one in required if one.startswith("numba")] == [f"numba=={version('numba')}"]
    source = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    assert [one for one in source if one.startswith("numba")] == ["numba>=0.68"]


def test_a_source_tree_has_none(told, before_numba):
    assert told(None) == {}


def test_what_the_user_has_told_numba_stands(told, before_numba):
    assert told(THIS, NUMBA_CPU_NAME="generic") == {"NUMBA_CPU_NAME": "generic"}


def test_a_process_that_has_loaded_numba_keeps_its_target(told):
    assert told(THIS) == {}


def test_features_are_in_the_words_of_the_target():
    assert sys.platform != "linux" or packed._features() & {"sse2", "neon", "64bit"}


@pytest.mark.slow
@pytest.mark.skipif(sysconfig.get_platform() != "linux-x86_64", reason="wheels carry kernels there alone")
def test_the_sample_compiles_nothing_where_a_wheel_is_installed(tmp_path):
    """The wheel is unpacked into a new environment, which shares the other packages with this one."""
    pytest.importorskip("setuptools", "77")
    build = "import sys, wheel_with_kernels; wheel_with_kernels.build_wheel(sys.argv[1])"
    subprocess.run(
        [sys.executable, "-c", build, str(tmp_path)], cwd=ROOT, check=True, stdout=subprocess.DEVNULL
    )
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.stem.endswith(
        f"-cp{sys.version_info.major}{sys.version_info.minor}-none-manylinux_2_28_x86_64"
    )
    venv.create(tmp_path / "new")
    (packages,) = (tmp_path / "new").glob("lib/python*/site-packages")
    shared = [path for path in sys.path if Path(path).name == "site-packages"]
    (packages / "shared.pth").write_text("\n".join(shared), encoding="utf-8")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    database = f"sqlite:///{tmp_path}/window.db"
    # what the environment of the tests tells Python and numba is not for the new one
    environment = {
        name: text for name, text in os.environ.items() if not name.startswith(("NUMBA_", "PYTHON"))
    }
    for command in (
        ("ingest", SAMPLE / "window.moma", "--db", database),
        ("run", SAMPLE / "window.toml", "--db", database, "--out", tmp_path / "out"),
    ):
        subprocess.run(
            [tmp_path / "new/bin/python", "-P", "-c", COUNTING, tmp_path / "seen.json", *command],
            cwd=tmp_path,
            env=environment,
            check=True,
            capture_output=True,
        )
        seen = json.loads((tmp_path / "seen.json").read_text(encoding="utf-8"))
        assert Path(seen["from"]).is_relative_to(packages)
        assert seen["compiled"] == []
