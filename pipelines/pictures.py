"""Pictures of a result: what to draw, in a process of its own, and what to say when it cannot be drawn."""

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mechanics.result import Outcome, Result
from moma.errors import MissingLibraryError
from pipelines.stone_values import stress_statistics
from pipelines.surfaces import save_surface, wall_surface

__all__ = ["draw_pictures", "package_of"]

_TIMEOUT = 300.0  # seconds; software rendering of 10⁵ triangles takes a few
_PACKAGES = {
    "libGL": "libgl1",
    "libGLX": "libglx0",
    "libOpenGL": "libopengl0",
    "libEGL": "libegl1",
    "libOSMesa": "libosmesa6",
    "libX11": "libx11-6",
    "libXrender": "libxrender1",
    "libXcursor": "libxcursor1",
    "libXext": "libxext6",
    "libXt": "libxt6",
    "libSM": "libsm6",
    "libICE": "libice6",
}
_ENDINGS = {
    Outcome.EQUILIBRIUM: "at equilibrium",
    Outcome.MOVING: "still moving",
    Outcome.COLLAPSED: "collapsed",
}


def package_of(message: str) -> str | None:
    """Debian package of the shared library that a loader's message names; None if it names none."""
    found = re.search(r"(lib[A-Za-z0-9_+-]+?)(?:-\d[\d.]*)?\.so", message)
    return _PACKAGES.get(found.group(1)) if found else None


def draw_pictures(
    result: Result, folder: Path, names: Sequence[str], towards: NDArray[np.float64]
) -> tuple[str, ...]:
    """Draw the named pictures (von_mises, displacement) into a folder, seen from the side `towards`.

    Returns the file names. `von_mises` is left out when no stone deforms.

    Raises
    ------
    MissingLibraryError : VTK cannot be loaded or cannot draw on this machine
    """
    statistics = stress_statistics(result)
    wanted = [name for name in names if name != "von_mises" or statistics is not None]
    if not wanted:
        return ()
    up = -np.array(result.scene.gravity)
    jobs = [
        {
            "quantity": name,
            "path": str((folder / f"{name}.png").absolute()),
            "top": statistics.p99 if name == "von_mises" and statistics is not None else None,
            "title": _title(result, name),
            "towards": towards.tolist(),
            "up": up.tolist() if up.any() else [0.0, 0.0, 1.0],
        }
        for name in wanted
    ]
    with tempfile.TemporaryDirectory() as scratch:
        surface = Path(scratch) / "surface.npz"
        save_surface(surface, wall_surface(result))
        job_file = Path(scratch) / "job.json"
        job_file.write_text(json.dumps({"surface": str(surface), "pictures": jobs}), encoding="utf-8")
        _draw_apart(job_file)
    return tuple(f"{name}.png" for name in wanted)


def _title(result: Result, quantity: str) -> str:
    what = {"von_mises": "Von Mises stress", "displacement": "displacement"}[quantity]
    return f"{result.scene.name}: {what}, {_ENDINGS[result.outcome]} after {result.time:.3g} s"


def _draw_apart(job_file: Path) -> None:
    """Run pipelines.drawing on a job; its noise about displays is kept back unless it fails.

    EGL comes first: it needs no X server, and no X libraries either.
    """
    reason = ""
    for window in ("vtkEGLRenderWindow", None):
        done = _attempt(job_file, window)
        if done.returncode == 0:
            return
        if done.returncode == 3:
            reason = done.stdout.strip()
            package = package_of(reason) or "libgl1 libxrender1 libegl1"
            raise MissingLibraryError(
                f"VTK cannot be loaded: {reason}", remedy=f"install what it needs: apt-get install {package}"
            )
        reason = reason or _last_words(done.stderr) or f"it ended with code {done.returncode}"
    raise MissingLibraryError(
        f"VTK cannot draw off screen: {reason}",
        remedy="install software rendering: apt-get install libegl1 libgl1-mesa-dri",
    )


def _attempt(job_file: Path, window: str | None) -> "subprocess.CompletedProcess[str]":
    """One process that draws, with the given kind of VTK window; None: the one that VTK would take."""
    root = str(Path(__file__).resolve().parent.parent)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])}
    if window is not None:
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", window)
    try:
        return subprocess.run(
            [sys.executable, "-m", "pipelines.drawing", str(job_file)],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TIMEOUT,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise MissingLibraryError(f"no picture after {_TIMEOUT:.0f} s") from None


def _last_words(stderr: str) -> str:
    """The last line that a process said, without VTK's time stamps and colours."""
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).strip() for line in stderr.splitlines()]
    last = next((line for line in reversed(lines) if line), "")
    return re.split(r"(?:WARN|ERR)\| ", last)[-1][:200].rstrip(".")
