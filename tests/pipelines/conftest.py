"""Databases of the sample window that tests of several rooms share."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from archmodel.database.session import open_database
from pipelines.ingest.ingest import ingest
from tests.paths import ROOT


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
