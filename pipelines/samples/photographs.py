"""Twelve synthetic photographs of the window bay: a project to orient them, and its stones marked on them.

Nothing is rendered: points of the true stones are projected by known cameras with lens distortion, with noise, as
if they had been marked. Joints are open as in the survey; corners are sound.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np

from moma.errors import UsageError
from pipelines.samples.buildings.window import WindowBay, make_window
from pipelines.samples.measure import inset, margin_points
from survey.arrays import Array
from survey.orientation.network import Camera, Photo
from survey.orientation.projection import project
from survey.orientation.rotations import from_angles

__all__ = ["PHOTOGRAPHED", "PHOTOGRAPHS", "TrueCamera", "true_cameras", "write_photographs"]

PHOTOGRAPHED = ("photographs.toml", "marks.txt", "control.txt", "marked.moma")
"""Names of the files that are written."""

PHOTOGRAPHS = 12
_SEED = 12
_SIGMA = 0.5  # standard deviation of a mark [px]
_CONTROL_SIGMA = 0.001  # of each coordinate of a control point [m]
_CONTROL = (5, 4)  # targets along and up the wall
_TIES = 80  # further points that only tie photographs together
_POINTS = 6  # points on each face besides its corners
_SHOWN = 3  # photographs on which a corner or point is marked
_DISTANCE = 6.5  # of the stations from the wall [m]
_DRAWN = 9  # every so many stones, the outline is drawn on one photograph
_SINGLE = 7  # every so many stones, one corner is marked on one photograph only

_CAMERA = Camera(
    "camera",
    np.array([24.0, 18.06, 11.95, 0.0, 0.0, 1.1e-4, -1.4e-7, 0.0, 1.2e-5, -0.8e-5]),
    (6000, 4000),
    24.0 / 4000,
)


@dataclass(frozen=True)
class TrueCamera:
    """A photograph with its true orientation."""

    photo: Photo

    def see(self, points: Array) -> Array:
        """Return where it shows points, (n, 2) [px]."""
        assert self.photo.rotation is not None
        assert self.photo.station is not None
        return project(_CAMERA, self.photo.rotation, self.photo.station, points)


_PROJECT = """\
# Twelve photographs of the window bay; synthetic. Explained in docs/howto/photographs.md.
name = "window bay, photographs (synthetic)"
marks = "marks.txt"
control = "control.txt"
check = ["T07", "T14"]
sigma = {sigma}          # px, of a mark
blunders = "remove"

# As the maker states it; calibrated from the marks.
[[cameras]]
name = "camera"
size = [6000, 4000]  # px
pixel = 0.006        # mm
c = 24.0             # mm
calibrate = ["c", "xp", "yp", "K1", "K2", "P1", "P2"]
"""


def write_photographs(folder: Path) -> tuple[str, ...]:
    """Write photographs.toml, marks.txt, control.txt and marked.moma into a folder; return their paths.

    Raises
    ------
    UsageError
        if a file would be overwritten
    """
    paths = [folder / name for name in PHOTOGRAPHED]
    for path in paths:
        if path.exists():
            raise UsageError(f"{path} exists", remedy="name another folder: --out DIR")
    bay, rng = make_window(), Random(_SEED)
    cameras = list(true_cameras(bay))
    names, points = _targets(bay, rng)
    folder.mkdir(parents=True, exist_ok=True)
    texts = (
        _PROJECT.format(sigma=_SIGMA),
        _marks(names, points, cameras, rng),
        _control(names, points, rng),
        _stones(bay, cameras, rng),
    )
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text, encoding="utf-8", newline="\n")
    return tuple(map(str, paths))


def true_cameras(bay: WindowBay) -> Iterator[TrueCamera]:
    """Yield the photographs: two rows of six, convergent, every third turned by a right angle."""
    frame = bay.frame
    for k in range(PHOTOGRAPHS):
        row, column = divmod(k, PHOTOGRAPHS // 2)
        along, up = -2.6 + 5.3 * column / 5, 0.7 + 2.4 * row
        station = frame.origin + np.array([along, up, _DISTANCE + 0.4 * (column % 2)]) @ frame.axes
        target = frame.origin + np.array([0.35 * along, 1.95, 0.0]) @ frame.axes
        back = (station - target) / np.linalg.norm(station - target)
        right = np.cross(frame.axes[1], back)
        right /= np.linalg.norm(right)
        upright = np.column_stack([right, np.cross(back, right), back])
        turned = upright @ from_angles(0.0, 0.0, np.pi / 2 if k % 3 == 2 else 0.0)
        yield TrueCamera(Photo(f"P{k + 1:02d}", 0, turned, np.round(station, 4)))


def _targets(bay: WindowBay, rng: Random) -> tuple[list[str], Array]:
    """Return control targets and tie points on and before the wall."""
    columns, rows = _CONTROL
    flat = [
        (-2.1 + 4.3 * c / (columns - 1), 0.25 + 3.3 * r / (rows - 1), 0.02 + 0.25 * ((r + c) % 2))
        for r in range(rows)
        for c in range(columns)
    ]
    flat += [
        (rng.uniform(-2.3, 2.4), rng.uniform(0.05, 3.85), rng.uniform(-0.02, 0.05)) for _ in range(_TIES)
    ]
    names = [f"T{k + 1:02d}" for k in range(columns * rows)] + [f"{k + 1}" for k in range(_TIES)]
    return names, bay.frame.origin + np.array(flat) @ bay.frame.axes


def _marked(camera: TrueCamera, points: Array, rng: Random) -> Array:
    noise = np.array([[rng.gauss(0.0, _SIGMA), rng.gauss(0.0, _SIGMA)] for _ in points])
    return np.asarray(np.round(camera.see(points) + noise, 2))


def _inside(image: Array) -> Array:
    return np.asarray(((image > 5.0) & (image < np.array(_CAMERA.size) - 5.0)).all(axis=1))


def _marks(names: list[str], points: Array, cameras: list[TrueCamera], rng: Random) -> str:
    lines = ["# photograph, point, x, y [px]"]
    for camera in cameras:
        image = _marked(camera, points, rng)
        for name, (x, y), inside in zip(names, image.tolist(), _inside(image), strict=True):
            if inside:
                lines.append(f"{camera.photo.name}, {name}, {x:.2f}, {y:.2f}")
    return "\n".join([*lines, ""])


def _control(names: list[str], points: Array, rng: Random) -> str:
    lines = ["# point, name, X, Y, Z, standard deviations [m]"]
    for name, place in zip(names, points, strict=True):
        if name.startswith("T"):
            x, y, z = (value + rng.gauss(0.0, _CONTROL_SIGMA) for value in place.tolist())
            lines.append(
                f"{name}, target, {x:.4f}, {y:.4f}, {z:.4f}, {_CONTROL_SIGMA}, {_CONTROL_SIGMA}, {_CONTROL_SIGMA}"
            )
    return "\n".join([*lines, ""])


def _stones(bay: WindowBay, cameras: list[TrueCamera], rng: Random) -> str:
    """Return the stones as a native survey whose points are marked."""
    lines = [
        "moma-survey 1",
        "name window bay, photographs (synthetic)",
        "orientation photographs/orientation.json",
    ]
    lines += [
        f"depth {rule.kind} {rule.depth:.4f} sigma {rule.sigma:.4f} source {rule.source}"
        for rule in bay.survey.head.depth_rules
    ]
    for number, (stone, measured) in enumerate(zip(bay.stones, bay.measured, strict=True)):
        visible = inset(stone.plan.corners, measured.half_joints)
        corners = stone.on_face(bay.frame, visible)
        points = stone.on_face(bay.frame, margin_points(visible, _POINTS, rng))
        record = measured.record
        course = "" if record.course is None else f" course {record.course}"
        lines += ["", f"stone {record.code} {record.kind}{course}"]
        if record.depth is not None:
            lines.append(
                f"  depth {record.depth:.4f} sigma {record.depth_sigma:.4f} source {record.depth_source}"
            )
        shown = rng.sample(range(len(cameras)), len(cameras))
        if number % _DRAWN == 4:
            one = next(cameras[k] for k in shown if _inside(cameras[k].see(corners)).all())
            lines.append(f"  photo {one.photo.name}")
            lines += [f"  pixel {x:.2f} {y:.2f}" for x, y in _marked(one, corners, rng).tolist()]
        else:
            for k, corner in enumerate(corners, start=1):
                single = number % _SINGLE == 3 and k == 2
                lines += _point(f"c{k}", "vertex", corner, cameras, shown, 1 if single else _SHOWN, rng)
        for k, point in enumerate(points, start=1):
            lines += _point(f"p{k}", "point", point, cameras, shown, _SHOWN, rng)
        lines.append("end")
    return "\n".join([*lines, ""])


def _point(
    name: str, role: str, place: Array, cameras: list[TrueCamera], order: list[int], count: int, rng: Random
) -> list[str]:
    """Return the marks of a point on photographs that show it, far apart from each other."""
    able = [k for k in order if _inside(cameras[k].see(place[None]))[0]]
    chosen = able[:1]
    while len(chosen) < min(count, len(able)):
        left = [k for k in able if k not in chosen]
        chosen.append(max(left, key=lambda k: min(_apart(cameras[k], cameras[o]) for o in chosen)))
    seen = {k: _marked(cameras[k], place[None], rng)[0].tolist() for k in sorted(chosen)}
    return [f"  mark {name} {role} {cameras[k].photo.name} {x:.2f} {y:.2f}" for k, (x, y) in seen.items()]


def _apart(one: TrueCamera, other: TrueCamera) -> float:
    assert one.photo.station is not None
    assert other.photo.station is not None
    return float(np.linalg.norm(one.photo.station - other.photo.station))
