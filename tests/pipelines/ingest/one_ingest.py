"""Imported by the process that ingests are forked from: one ingest, so that all is loaded that it needs."""

import tempfile
from pathlib import Path

from pipelines.ingest.ingest import ingest
from tests.pipelines.ingest.killable_ingest import wall_survey

with tempfile.TemporaryDirectory() as _folder:
    ingest([wall_survey(Path(_folder) / "wall.moma", "A", 150)], "sqlite://")
