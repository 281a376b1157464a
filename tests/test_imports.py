"""Who may import whom, and what the face offers."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import moma
from tests.paths import ROOT

PACKAGES = ("ground", "moma", "survey", "archmodel", "mechanics", "pipelines")


def test_the_import_rule_holds():
    """Layers of packages, and no circle of rooms or modules, as pyproject.toml states them."""
    done = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 kept, 0 broken" in done.stdout


@pytest.mark.parametrize(
    ("module", "loaded_late"),
    [
        ("moma", ("numpy", "sqlalchemy", "numba", "vtkmodules", "typer")),
        (
            "moma.cli",
            ("numpy", "sqlalchemy", "numba", "gmsh", "pyvista", "vtkmodules", "scipy", "matplotlib"),
        ),
        ("mechanics.simulate", ("sqlalchemy", "typer", "vtkmodules")),
        ("archmodel.database.session", ("numpy", "alembic", "psycopg", "numba", "typer", "scipy")),
        ("archmodel.query.api", ("numpy", "numba", "typer", "vtkmodules", "scipy")),
        ("moma.cli.text.query", ("numpy", "sqlalchemy.dialects.postgresql")),
        (
            "survey.formats.reading",
            ("sqlalchemy", "numba", "typer", "vtkmodules", "trimesh", "meshio", "scipy"),
        ),
        ("survey.joints.close", ("sqlalchemy", "typer", "vtkmodules")),
        ("pipelines.run.run", ("typer", "vtkmodules", "matplotlib")),
        ("pipelines.record.export.export", ("typer", "numba", "scipy", "vtkmodules", "ezdxf")),
    ],
)
def test_a_module_loads_only_what_it_needs(module, loaded_late):
    program = f"import sys, {module}; print([one for one in {loaded_late} if one in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_the_face_alone_lists_its_names():
    """Elsewhere the underscore says what is private, and a name is imported from the module that defines it."""
    listing = {
        str(path.relative_to(ROOT))
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if re.search(r"^__all__\b", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert listing == {"moma/__init__.py"}


def test_the_face_offers_what_it_lists():
    for name, home in moma._HOMES.items():
        assert getattr(getattr(moma, name), "__module__", home) == home
    assert list(moma._HOMES) == sorted(moma._HOMES, key=lambda name: (not name[0].isupper(), name))
