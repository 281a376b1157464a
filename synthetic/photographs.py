"""Twelve synthetic photographs of the window bay: a project to orient them, and its stones marked on them.

Marks are points of the true stones, projected by known cameras with lens distortion, with noise, as if somebody had
marked them. The photographs themselves are rendered of the same scene by the same cameras. Joints are open as in the
survey; corners are sound.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np
from numpy.typing import NDArray

from ground.errors import UsageError
from pipelines.draw.pictures import draw_apart
from survey.arrays import Array
from survey.orientation.network import Camera, Photo
from survey.orientation.projection import project
from survey.orientation.rotations import from_angles
from synthetic.buildings.window import WindowBay, make_window
from synthetic.measure import inset, margin_points
from synthetic.rendered_photographs import PhotographedScene

PHOTOGRAPHED = ("photographs.toml", "marks.txt", "control.txt", "marked.moma")
"""Names of the files that are written."""

_PHOTOGRAPHS = 12

PICTURES = tuple(f"P{k + 1:02d}.jpg" for k in range(_PHOTOGRAPHS))
"""Names of the rendered photographs."""

_REDUCED = 4  # pixels of the camera along a pixel of a rendered photograph
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
_MORTAR = 0.012  # distance of the mortar behind the wall's plane [m]
_BEHIND = 0.35  # distance of what is seen through the window behind the wall [m]
_ROOM = 0.3  # seen beyond the edges of the panel [m]
_TEXTURE = 0.003  # side of a pixel of the wall's texture [m]
_GREY = 9.0  # standard deviation of the texture of stones and mortar [of 255]
_PLATE, _DISC, _DOT = (
    0.04,
    0.015,
    0.008,
)  # half the side of a target's plate, radii of its disc and of a tie point [m]

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
{pictures}sigma = {sigma}          # px, of a mark
blunders = "remove"

# As the maker states it; calibrated from the marks.
[[cameras]]
name = "camera"
size = [6000, 4000]  # px
pixel = 0.006        # mm
c = 24.0             # mm
calibrate = ["c", "xp", "yp", "K1", "K2", "P1", "P2"]
"""
_PICTURES = 'pictures = "pictures"   # P01.jpg …, a quarter of the size that the camera states\n'


def write_photographs(folder: Path, pictures: bool = False) -> tuple[str, ...]:
    """Write photographs.toml, marks.txt, control.txt and marked.moma into a folder; return their paths.

    Parameters
    ----------
    pictures : the project names the folder `pictures` of the photographs themselves

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
        _PROJECT.format(sigma=_SIGMA, pictures=_PICTURES if pictures else ""),
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
    for k in range(_PHOTOGRAPHS):
        row, column = divmod(k, _PHOTOGRAPHS // 2)
        along, up = -2.6 + 5.3 * column / 5, 0.7 + 2.4 * row
        station = frame.origin + np.array([along, up, _DISTANCE + 0.4 * (column % 2)]) @ frame.axes
        target = frame.origin + np.array([0.35 * along, 1.95, 0.0]) @ frame.axes
        back = (station - target) / np.linalg.norm(station - target)
        right = np.cross(frame.axes[1], back)
        right /= np.linalg.norm(right)
        upright = np.column_stack([right, np.cross(back, right), back])
        turned = upright @ from_angles(0.0, 0.0, np.pi / 2 if k % 3 == 2 else 0.0)
        yield TrueCamera(Photo(f"P{k + 1:02d}", 0, turned, np.round(station, 4)))


def render_photographs(folder: Path) -> None:
    """Render the photographs into a folder, a quarter of their size along either side.

    Raises
    ------
    MissingLibraryError
        if nothing can be drawn on this machine
    """
    bay = make_window()
    names, points = _targets(bay, Random(_SEED))
    jobs = [
        {
            "path": str((folder / f"{camera.photo.name}.jpg").absolute()),
            "inner": _CAMERA.inner.tolist(),
            "size": list(_CAMERA.size),
            "pixel": _CAMERA.pixel,
            "forward": _CAMERA.forward,
            "rotation": np.asarray(camera.photo.rotation).tolist(),
            "station": np.asarray(camera.photo.station).tolist(),
            "reduced": _REDUCED,
        }
        for camera in true_cameras(bay)
    ]
    draw_apart("synthetic.rendered_photographs", _scene(bay, names, points), jobs)


def _scene(bay: WindowBay, names: list[str], points: Array) -> PhotographedScene:
    """Return stones before their mortar, the room behind the window, targets on plates, and tie points."""
    frame, rng = bay.frame, np.random.default_rng(_SEED)
    plans = np.array([stone.plan.corners for stone in bay.stones])
    low, high = plans.reshape(-1, 2).min(axis=0) - _ROOM, plans.reshape(-1, 2).max(axis=0) + _ROOM
    textured, plain, colours = list[Array](), list[Array](), list[tuple[int, int, int]]()
    for stone, measured in zip(bay.stones, bay.measured, strict=True):
        front = stone.on_face(frame, inset(stone.plan.corners, measured.half_joints))
        back = front - 2.0 * _MORTAR * frame.axes[2]
        textured += [front, frame.place(stone.plan.corners, -_MORTAR)]
        for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
            plain.append(np.array([front[b], front[a], back[a], back[b]]))
            colours.append((96, 90, 82))
    plain.append(frame.place(np.array([low, (high[0], low[1]), high, (low[0], high[1])]), -_BEHIND))
    colours.append((58, 60, 66))
    for name, place in zip(names, points, strict=True):
        target = name.startswith("T")
        if target:
            square = _PLATE * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
            plain.append(place - 0.001 * frame.axes[2] + square @ frame.axes[:2])
            colours.append((20, 20, 20))
        for quad in _disc(_DISC if target else _DOT):
            plain.append(place + quad @ frame.axes[:2])
            colours.append((245, 245, 245) if target else (150, 30, 30))
    corners = np.concatenate([*textured, *plain])
    flat = (corners - frame.origin) @ frame.axes[:2].T
    index = np.arange(len(corners)).reshape(-1, 4)
    return PhotographedScene(
        corners,
        index[len(textured) :],
        np.array(colours, dtype=np.uint8),
        index[: len(textured)],
        np.clip((flat - low) / (high - low), 0.0, 1.0),
        _texture(bay, low, high, rng),
    )


def _disc(radius: float) -> Iterator[Array]:
    """Yield quadrilaterals (4, 2) that form a regular polygon of 24 corners about the origin."""
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    ring = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    for k in range(0, 24, 2):
        yield np.array([[0.0, 0.0], *ring[k : k + 3]])


def _texture(bay: WindowBay, low: Array, high: Array, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Paint mortar and stones in the plane of the wall, the first row at its top."""
    from PIL import Image, ImageDraw

    width, height = np.ceil((high - low) / _TEXTURE).astype(int).tolist()
    picture = Image.new("RGB", (width, height), (168, 160, 146))
    pen = ImageDraw.Draw(picture)
    for stone, measured in zip(bay.stones, bay.measured, strict=True):
        flat = (inset(stone.plan.corners, measured.half_joints) - low) / (high - low)
        tone = 150.0 + 22.0 * rng.normal()
        colour = (int(tone * 1.02), int(tone * 0.96), int(tone * 0.85))
        pen.polygon([(x * width, (1.0 - y) * height) for x, y in flat.tolist()], fill=colour)
    grain = np.zeros((height, width))
    for coarse in (1, 4, 16):
        small = rng.normal(size=(height // coarse + 1, width // coarse + 1))
        grain += np.kron(small, np.ones((coarse, coarse)))[:height, :width] / np.sqrt(3.0)
    return np.asarray(np.clip(np.asarray(picture) + _GREY * grain[..., None], 0, 255), dtype=np.uint8)


def _targets(bay: WindowBay, rng: Random) -> tuple[list[str], Array]:
    """Return control targets and tie points on and before the wall."""
    columns, rows = _CONTROL
    flat = [
        (-2.1 + 4.3 * c / (columns - 1), 0.25 + 3.3 * r / (rows - 1), 0.02 + 0.25 * ((r + c) % 2))
        for r in range(rows)
        for c in range(columns)
    ]
    flat += [(rng.uniform(-2.3, 2.4), rng.uniform(0.05, 3.85), rng.uniform(0.01, 0.05)) for _ in range(_TIES)]
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
            camera = next(cameras[k] for k in shown if _inside(cameras[k].see(corners)).all())
            lines.append(f"  photo {camera.photo.name}")
            lines += [f"  pixel {x:.2f} {y:.2f}" for x, y in _marked(camera, corners, rng).tolist()]
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


def _apart(first: TrueCamera, second: TrueCamera) -> float:
    assert first.photo.station is not None
    assert second.photo.station is not None
    return float(np.linalg.norm(first.photo.station - second.photo.station))
