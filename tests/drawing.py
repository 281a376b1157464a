"""Pictures that no test looks at: blank ones, instead of a process of 3 s that loads VTK and draws."""

import base64
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from pipelines.draw import pictures
from pipelines.draw.offscreen.jobs import save_job

BLANK = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR42mP4DwABAQEAG7buVgAAAABJRU5ErkJggg=="
)
truly = pictures.draw_apart
truly_started = pictures.drawing_process
drawing = True


def allow(item: pytest.Item) -> None:
    """Let a test draw in truth where it is marked `draws`, as fixtures of its module do."""
    global drawing
    drawing = item.get_closest_marker("draws") is not None


def draw_apart(
    module: str,
    surface: object,
    jobs: Sequence[Mapping[str, Any]],
    ready: "subprocess.Popen[str] | None" = None,
) -> None:
    """Draw pictures, or write a job that could draw them and leave blank ones."""
    if drawing:
        truly(module, surface, jobs, ready)
        return
    with tempfile.TemporaryDirectory() as scratch:
        save_job(Path(scratch), surface, jobs)
    for job in jobs:
        Path(job["path"]).write_bytes(BLANK)


@contextmanager
def drawing_process(module: str, *window: str | None) -> Iterator["subprocess.Popen[str] | None"]:
    """Start the process that loads VTK ahead of a picture, where a test draws in truth."""
    if not drawing:
        yield None
        return
    with truly_started(module, *window) as process:
        yield process


# before the modules that import their names
pictures.draw_apart = draw_apart
pictures.drawing_process = drawing_process
