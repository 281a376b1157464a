"""Jobs of a drawing process: one surface as .npz, and its pictures as JSON.

The modules that draw run in a process of their own (``python -m pipelines.draw.offscreen.result``, which then reads the
name of a job's file): a graphics library that is missing or broken may end the process that uses it, and must not take
the results along. Such a process may be started long before there is something to draw.
"""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from pipelines.draw.offscreen.parts import new_plotter

Surface = TypeVar("Surface")


def save_job(folder: Path, surface: Any, pictures: Sequence[Mapping[str, Any]]) -> Path:
    """Write a job into a folder; return its file.

    Parameters
    ----------
    surface : dataclass of arrays
    pictures : their paths, and what the drawing module reads of each
    """
    save_surface(folder / "surface.npz", surface)
    job = folder / "job.json"
    job.write_text(
        json.dumps({"surface": str(folder / "surface.npz"), "pictures": pictures}), encoding="utf-8"
    )
    return job


def run_job(kind: type[Surface], draw: Callable[[Surface, Path, dict[str, Any]], None]) -> int:
    """Load what draws, and draw the pictures of the job whose file is named on stdin; without a name, nothing.

    Return 3 if a library cannot be loaded, with its message on stdout.
    """
    try:
        import matplotlib.colors  # noqa: F401
        import pyvista
    except ImportError as error:
        print(error)
        return 3

    new_plotter(pyvista).close()  # the first one loads the libraries of the system
    if not (name := sys.stdin.readline().strip()):
        return 0
    job = json.loads(Path(name).read_text(encoding="utf-8"))
    surface = load_surface(Path(job["surface"]), kind)
    for picture in job["pictures"]:
        draw(surface, Path(picture["path"]), picture)
    return 0


def save_surface(path: Path, surface: Any) -> None:
    """Write a dataclass of arrays as .npz."""
    np.savez(path, **{field.name: getattr(surface, field.name) for field in fields(surface)})


def load_surface(path: Path, kind: type[Surface]) -> Surface:
    """Read a dataclass of arrays that `save_surface` wrote."""
    with np.load(path, allow_pickle=False) as arrays:
        return kind(**dict(arrays))
