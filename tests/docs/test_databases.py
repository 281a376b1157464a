"""The commands of docs/databases.md run as they are written, those of PostgreSQL on a server of the tests."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from archmodel.tables.layout import SCHEMA_VERSION
from tests.paths import ROOT
from tests.postgresql import Server


def commands(title: str) -> list[str]:
    """The commands of one section of the page."""
    page = (ROOT / "docs/databases.md").read_text(encoding="utf-8")
    (section,) = re.findall(rf"^## {title}\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    found = re.findall(r"^```bash\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)
    return [line for block in found for line in block.splitlines()]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    sample = tmp_path / "data/samples/window"
    sample.mkdir(parents=True)
    (sample / "window.moma").symlink_to(ROOT / "data/samples/window/window.moma")
    return tmp_path


def run(command: str, folder: Path, **environment: str) -> str:
    """What a command prints; it must succeed."""
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    inherited = {name: value for name, value in os.environ.items() if name != "MOMA_DB"}
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env={**inherited, "PATH": programs, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (command, done.stderr)
    return done.stdout


def test_the_commands_for_sqlite(folder: Path) -> None:
    found = commands("SQLite")
    assert len(found) == 3
    outputs = [run(command, folder) for command in found]
    assert "V4" in outputs[1]
    assert "V4" in run("moma query keystone --db sqlite:///copy.db", folder)


def test_the_commands_for_postgresql(folder: Path, postgresql: Server) -> None:
    found = commands("PostgreSQL")
    assert found.pop(0) == "python -m pip install 'moma-masonry[postgresql]'"
    try:
        for command in found:
            if not command.startswith("moma"):
                command = f"{postgresql.programs}/{command}"
            output = run(command, folder, PGHOST=str(postgresql.folder), PGUSER=postgresql.user)
            assert "V4" in output or not command.startswith("moma query")
        again = run(
            "moma query keystone --db postgresql:///castle_again",
            folder,
            PGHOST=str(postgresql.folder),
            PGUSER=postgresql.user,
        )
        assert "V4" in again
    finally:
        for name in ("castle", "castle_again"):
            postgresql.execute(f"DROP DATABASE IF EXISTS {name} WITH (FORCE)")


def test_the_commands_for_versions(folder: Path) -> None:
    run(commands("SQLite")[0], folder)
    (migrate,) = commands("Versions")
    assert f"has version {SCHEMA_VERSION} already" in run(migrate, folder)
