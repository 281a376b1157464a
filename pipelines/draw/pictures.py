"""Pictures of a result, drawn by a child process, and remedies where nothing can be drawn."""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.store.run_record import without_rounding
from ground.errors import MissingLibraryError, missing_library
from mechanics.arrays import Array
from mechanics.dynamics.outcome import Outcome
from mechanics.results.result import BodyResult, Result
from mechanics.results.stress_values import volume_quantile
from mechanics.scene.scene import Fidelity
from mechanics.stones.materials import Material
from pipelines.draw.catalogue import PICTURES
from pipelines.draw.offscreen.jobs import save_job
from pipelines.draw.offscreen.surfaces import FIELDS, stone_fields, support_motion, wall_surface
from pipelines.results.peaks import peak_records
from pipelines.results.summary import length_tolerance
from survey.conventions import FEW

OF_RESULTS = "pipelines.draw.offscreen.result"
"""Module that draws the pictures of a result."""


_PASSED = 1.0 + FEW  # peak over the value at the end, from which a picture of the end states it [-]
_WINDOWS = (
    "vtkEGLRenderWindow",
    None,
)  # kinds of VTK's windows, tried in turn; None leaves the choice to VTK
_TIMEOUT = 300.0  # [s]; software rendering of 10⁵ triangles takes a few
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
    Outcome.SETTLED: "SETTLED elsewhere",
    Outcome.MOVING: "still moving",
    Outcome.COLLAPSED: "collapsed",
    Outcome.UNDECIDED: "UNDECIDED",
    Outcome.INTERRUPTED: "INTERRUPTED",
}


def package_of(message: str) -> str | None:
    """Return the Debian package of the shared library that a loader's message names; None if it names none."""
    match = re.search(r"(lib[A-Za-z0-9_+-]+?)(?:-\d[\d.]*)?\.so", message)
    return _PACKAGES.get(match.group(1)) if match else None


def draw_pictures(
    result: Result,
    folder: Path,
    names: Sequence[str],
    towards: Array,
    ready: "subprocess.Popen[str] | None" = None,
) -> tuple[str, ...]:
    """Draw the named pictures into a folder, seen from the side `towards`; return the file names.

    Pictures for which `missing` has a reason are left out. `ready` is as in `draw_apart`, of `OF_RESULTS`.

    Raises
    ------
    MissingLibraryError : VTK cannot be loaded or cannot draw on this machine
    """
    wanted = [name for name in names if missing(result, name) is None]
    if not wanted:
        return ()
    up = -np.array(result.scene.gravity)
    jobs = [
        {
            "quantity": name,
            "path": str((folder / f"{name}.png").absolute()),
            "top": _top(result, name),
            "title": "\n".join(_heading(result, name)),
            "note": PICTURES[name].note,
            "towards": towards.tolist(),
            "up": up.tolist() if up.any() else [0.0, 0.0, 1.0],
        }
        for name in wanted
    ]
    draw_apart(OF_RESULTS, wall_surface(result), jobs, ready)
    return tuple(f"{name}.png" for name in wanted)


def missing(result: Result, name: str) -> str | None:
    """Give the reason why a picture would show nothing of this result; None if it shows something."""
    stressed = [body.values for body in result.bodies if body.values is not None]
    if PICTURES[name].shows == "joints":
        return None if result.joints.pressed.any() else "no joint is pressed"
    if PICTURES[name].shows == "stress" and not stressed:
        deforms = any(body.fidelity is Fidelity.DEFORMABLE for body in result.bodies)
        return "no stress was asked for" if deforms else "no stone deforms"
    if name == "utilisation" and all(stress.utilisation is None for stress in stressed):
        return "no material of a deformable stone has a strength"
    if name == "principal_tension" and all(
        without_rounding(stress.principal_tension, "Pa") <= 0.0 for stress in stressed
    ):
        return "no stone is in tension"
    least = length_tolerance(result)  # [m]
    if name == "displacement" and all(np.abs(body.displacement).max() < least for body in result.bodies):
        return f"no stone has moved by more than the tolerance of the solver, {least * 1e3:.1g} mm"
    return None


def _top(result: Result, name: str) -> float | None:
    """Return the end of the scale; None stands for the largest value.

    Stresses end where 1 % of the volume exceeds them, pressures where joints that bear 1 % of the force do.
    """
    if not PICTURES[name].capped:
        return None
    if name == "pressure":
        joints, rows = result.joints, result.joints.bearing
        if not rows.any():
            return None
        return volume_quantile(joints.pressure_mean[rows], (joints.pressure_mean * joints.area)[rows], 0.99)
    known = [
        (_fields_of(body, block.material, name), body.node_volume)
        for body, block in zip(result.bodies, result.scene.blocks, strict=True)
        if body.node_volume is not None
    ]
    values, volumes = (np.concatenate(column) for column in zip(*known, strict=True))
    finite = np.isfinite(values)
    return volume_quantile(values[finite], volumes[finite], 0.99) or None


def _heading(result: Result, name: str) -> list[str]:
    """Return the lines above a picture: content and outcome, the gravest caution, how large the values are."""
    picture, ending = PICTURES[name], f"{_ENDINGS[result.outcome]} after {result.time:.3g} s"
    seen = ""
    if (
        name == "displacement"
        and support_motion(result.bodies, [body.position for body in result.bodies]).any()
    ):
        seen = ", seen from the supports"
    lines = [f"{result.scene.name}: {picture.title}{seen}, {ending}", *result.cautions[:1]]
    passed = peak_records(result)["displacement"] if name == "displacement" else None
    if passed is not None and passed["value"] > _PASSED * passed["end"]:
        factor, unit = picture.unit_of(passed["value"])
        where = f"{passed['stones'][0]} after {passed['time']:.3g} s"
        lines.append(f"at the end; during the run up to {passed['value'] * factor:.4g} {unit} ({where})")
    largest = _largest(result, name) if picture.capped else None
    if largest is not None:
        value, place = largest
        top = _top(result, name) or value
        factor, unit = picture.unit_of(value)
        written = [f"{number * factor:.4g}{f' {unit}' if unit else ''}" for number in (top, value)]
        if picture.shows == "stress":
            lines.append(f"1 % of the volume exceeds {written[0]}; at a corner up to {written[1]}, {place}")
        else:
            lines.append(f"largest: {written[1]}, {place}")
    return lines


def _largest(result: Result, name: str) -> tuple[float, str] | None:
    """Return the largest value of a capped picture, and its place in words."""
    if name == "pressure":
        return _largest_pressure(result)
    found = [
        (float(np.nanmax(values)), body)
        for body, block in zip(result.bodies, result.scene.blocks, strict=True)
        if np.isfinite(values := _fields_of(body, block.material, name)).any()
    ]
    value, body = max(found, key=lambda value: value[0], default=(0.0, None))
    if body is None or value <= 0.0:
        return None
    error = "" if body.values is None else f" (error of its stress {100.0 * body.values.error:.0f} %)"
    return value, f"in {body.code}{error}"


def _largest_pressure(result: Result) -> tuple[float, str] | None:
    """Return the largest mean pressure of a joint, its place, and how many slivers it leaves out."""
    joints = result.joints
    if not joints.bearing.any():
        return None
    number = int(np.where(joints.bearing, joints.pressure_mean, -np.inf).argmax())
    first, second = (result.bodies[body].code for body in joints.bodies[number])
    slivers = int((joints.pressed & joints.sliver).sum())
    out = f"; without slivers ({slivers})" if slivers else ""
    return float(joints.pressure_mean[number]), f"between {first} and {second}{out}"


def _fields_of(body: BodyResult, material: Material, name: str) -> Array:
    return stone_fields(body, material)[:, FIELDS.index(name)]


def draw_apart(
    module: str,
    surface: object,
    pictures: Sequence[Mapping[str, Any]],
    ready: "subprocess.Popen[str] | None" = None,
) -> None:
    """Draw pictures in a child process; its output about displays is suppressed unless it fails.

    EGL comes first: it needs no X server, and no X libraries either.

    Parameters
    ----------
    module : with the function `draw`, of `pipelines.draw.offscreen`
    surface : dataclass of arrays
    pictures : absolute path of each, and what the module reads of it
    ready : `drawing_process` of the module that has been started ahead

    Raises
    ------
    MissingLibraryError : VTK cannot be loaded or cannot draw on this machine
    """
    reason = ""
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as started:
        job = save_job(Path(scratch), surface, pictures)
        for window in _WINDOWS:
            process, ready = ready or started.enter_context(drawing_process(module, window)), None
            try:
                said, told = process.communicate(f"{job}\n", _TIMEOUT)
            except subprocess.TimeoutExpired:
                raise MissingLibraryError(f"no picture after {_TIMEOUT:.0f} s") from None
            if process.returncode == 0:
                return
            if process.returncode == 3:
                reason = said.strip()
                raise MissingLibraryError(f"VTK cannot be loaded: {reason}", remedy=_remedy(reason))
            reason = reason or _last_words(told) or f"it ended with code {process.returncode}"
    raise MissingLibraryError(
        f"VTK cannot draw off screen: {reason}",
        remedy="install software rendering: apt-get install libegl1 libgl1-mesa-dri",
    )


def _remedy(reason: str) -> str:
    """Return what to install where the process that draws cannot load its libraries."""
    if absent := re.search(r"No module named '(\w+)", reason):
        foreseen = missing_library(ModuleNotFoundError(name=absent[1]))
        return f"{foreseen.remedy}" if foreseen is not None else "install MOMA anew"
    return f"install what it needs: apt-get install {package_of(reason) or 'libgl1 libxrender1 libegl1'}"


@contextmanager
def drawing_process(module: str, window: str | None = _WINDOWS[0]) -> "Iterator[subprocess.Popen[str]]":
    """Start a process that loads VTK and then waits for a job, for a with-block; an interrupt does not reach it."""
    root = str(Path(__file__).resolve().parents[2])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])}
    if window is not None:
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", window)
    with subprocess.Popen(
        [sys.executable, "-m", module],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=environment,
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def _last_words(stderr: str) -> str:
    """Return the last line of a process's output, without VTK's time stamps and colours."""
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).strip() for line in stderr.splitlines()]
    last = next((line for line in reversed(lines) if line), "")
    return re.split(r"(?:WARN|ERR)\| ", last)[-1][:200].rstrip(".")
