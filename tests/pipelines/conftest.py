"""Databases of the sample window, and results of three walls of known numbers, that tests of several rooms share."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from archmodel.database.session import open_database
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Fidelity
from pipelines.ingest.ingest import ingest
from tests.paths import ROOT
from tests.pipelines.results_by_hand import LIMESTONE, deformable_body, result_of, rigid_body


@pytest.fixture(scope="session")
def sample_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """File of a database with the sample, which tests only read."""
    path = tmp_path_factory.mktemp("sample") / "window.db"
    ingest([ROOT / "data/samples/window/window.moma"], f"sqlite:///{path}")
    return path


@pytest.fixture
def url(sample_database: Path) -> str:
    """URL of a database with the sample, which tests only read."""
    return f"sqlite:///{sample_database}"


@pytest.fixture
def own_url(sample_database: Path, tmp_path: Path) -> str:
    """URL of a database with the sample, to which the test may write."""
    return f"sqlite:///{shutil.copy(sample_database, tmp_path / 'own.db')}"


@pytest.fixture
def session(url: str) -> Iterator[Session]:
    """A session on the sample, which tests only read."""
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        yield session


def height(points):
    """A stress that is linear in height, from 0 at z = 1 to 2 MPa at z = 3."""
    return 1e6 * (points[:, 2] - 1.0)


@pytest.fixture(scope="module")
def mixed():
    """A fixed, a deformable and a rigid block on each other."""
    return result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
            deformable_body("D1", (0, 0, 1), (1, 1, 3), height, size=0.5, shift=(0, 0, -0.002)),
            rigid_body("top", (0, 0, 3), (1, 1, 4), shift=(0, 0.003, -0.004)),
        ],
        pairs=((1, 0), (2, 1)),
        forces=((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0)),
    )


@pytest.fixture(scope="module")
def rigid():
    return result_of(
        [rigid_body("a", (0, 0, 0), (1, 1, 1), Fidelity.FIXED), rigid_body("b", (0, 0, 1), (1, 1, 2))],
        outcome=Outcome.COLLAPSED,
    )


@pytest.fixture(scope="module")
def strong():
    """As `mixed`, of a material with strengths."""
    material = replace(LIMESTONE, tensile_strength=1e6, compressive_strength=4e6)
    return result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
            deformable_body("D1", (0, 0, 1), (1, 1, 3), height, size=0.5, material=material),
            rigid_body("top", (0, 0, 3), (1, 1, 4)),
        ],
        pairs=((1, 0), (2, 1)),
        forces=((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0)),
        material=material,
    )
