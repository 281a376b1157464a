"""Who may import whom, and what a module says that it offers."""

import ast
import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.paths import ROOT

PACKAGES = ("ground", "moma", "survey", "archmodel", "mechanics", "pipelines")
MODULES = sorted(
    name
    for package in PACKAGES
    for name in [package, *(one.name for one in pkgutil.walk_packages([str(ROOT / package)], f"{package}."))]
    if not name.split(".")[-1].startswith("__") and name != "archmodel.migrations.env"  # which Alembic runs
)


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


def order(name):
    """Constants, then classes, then the rest, each sorted; as ruff's RUF022 has it."""
    natural = [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]
    group = 0 if name.isupper() and len(name) > 1 else 1 if name[:1].isupper() else 2
    return group, natural


def test_all_is_complete_and_sorted():
    wrong = {name: said for name in MODULES if (said := faults_of_all(name))}
    assert not wrong


def faults_of_all(name):
    """Return what is wrong with the `__all__` of a module; an empty list where nothing is."""
    module = importlib.import_module(name)
    offered = list(getattr(module, "__all__", []))  # a package that only explains itself offers nothing
    wrong = [] if offered == sorted(offered, key=order) else ["not sorted"]
    wrong += [f"{one} twice" for one in sorted(set(offered)) if offered.count(one) > 1]
    wrong += [f"no {one}" for one in offered if not hasattr(module, one)]
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    defined = {
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
    }
    return wrong + [f"{one} is not offered" for one in sorted(defined - set(offered))]
