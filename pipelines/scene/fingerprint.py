"""Fingerprint of all that decides on the bits of a run, part by part, so that a change can be named."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from mechanics.model.model import Model
from mechanics.planar.scene import PlanarScene
from mechanics.scene.scene import Scene
from mechanics.scene.stages import Stage
from mechanics.scene.state import State
from pipelines.scene.selection import StoneModel

_STONE = "stone "
_SHOWN = 9  # numbers up to which an array stands in full
DIGITS = 16  # of the digest of a larger one
_FREE = ("name", "solver.threads", "time.duration")  # settings that change no bit of the steps done so far


def fingerprint(
    scene: Scene,
    model: Model,
    start: State,
    stones: Sequence[StoneModel] = (),
    stages: Sequence[Stage] = (),
) -> dict[str, str]:
    """Return a text for each setting, load, stone and stage of a scene as it was built, and for its mesh.

    The solids of the `stones` in the database come first: where one changes, all others may be built otherwise.

    >>> from mechanics.scene.scene import TimeSettings
    >>> dict(_parts(TimeSettings(step=2e-3), "time"))["time.step"]
    '0.002'
    """
    settings = {field.name: getattr(scene, field.name) for field in fields(scene) if field.name != "blocks"}
    recorded = (
        (stone.record.code, [stone.record.solid_vertices, stone.record.solid_faces]) for stone in stones
    )
    digests = {f"{_STONE}{code}: solid in the database": digest(solid) for code, solid in recorded}
    digests |= dict(_parts(settings, ""))
    for block in scene.blocks:
        values = ((field.name, getattr(block, field.name)) for field in fields(block) if field.name != "code")
        digests |= {f"{_STONE}{block.code}: {name}": digest(value) for name, value in values}
    for number, stage in enumerate(stages, 1):
        standing = [(block.code, str(block.fidelity)) for block in stage.scene.blocks]
        what = {"name": stage.name, "stones": digest(standing), "loads": stage.scene.loads}
        what["duration"] = stage.scene.time.duration
        digests |= dict(_parts(what, f"stage {number}"))
    built = (
        start.centre,
        start.node,
        model.mass,
        model.fixed,
        [stone and stone.mesh for stone in model.stones],
    )
    return digests | {
        "order of the stones": digest([block.code for block in scene.blocks]),
        "meshes": digest(built),
    }


def planar_fingerprint(scene: PlanarScene) -> dict[str, str]:
    """Return a text for each setting, load and body of a scene of the plane."""
    settings = {
        field.name: getattr(scene, field.name)
        for field in fields(scene)
        if field.name not in ("disks", "walls")
    }
    bodies = [(f"disk {disk.code}", digest(disk)) for disk in scene.disks]
    bodies += [(f"wall {wall.code}", digest(wall)) for wall in scene.walls]
    return dict(_parts(settings, "")) | dict(bodies) | {"order of the bodies": digest(scene.codes)}


def changes(then: Mapping[str, str], now: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Return the differences that forbid to go on with a run, and those that do not, each in words."""
    forbidden, free = [*_missing(then, now, "is gone"), *_missing(now, then, "is new")], list[str]()
    for name in dict.fromkeys([*then, *now]):
        before, after = then.get(name), now.get(name)
        if before == after or (name.startswith(_STONE) and None in (before, after)):
            continue
        what = name if _is_digest(before) or _is_digest(after) else f"{name} {_or(before)}, now {_or(after)}"
        (free if name in _FREE else forbidden).append(what)
    return forbidden, free


def _missing(some: Mapping[str, str], others: Mapping[str, str], what: str) -> list[str]:
    """Name the stones of one scene that another does not have."""
    first, second = ({name.partition(": ")[0] for name in names} for names in (some, others))
    return [f"{name} {what}" for name in sorted(first - second) if name.startswith(_STONE)]


def _or(text: str | None) -> str:
    return "not given" if text is None else text


def _is_digest(text: str | None) -> bool:
    return text is not None and text.startswith("#")


def _parts(value: Any, path: str) -> Iterator[tuple[str, str]]:
    """Yield the path and the text of each part of a value made of dataclasses, collections, arrays and plain values."""
    if is_dataclass(value):
        yield f"{path}.type", type(value).__name__
        value = {field.name: getattr(value, field.name) for field in fields(value)}
    if isinstance(value, Mapping):
        for name, entry in value.items():
            yield from _parts(entry, f"{path}.{name}" if path else str(name))
    elif isinstance(value, frozenset):
        yield path, _text(sorted(value))
    elif isinstance(value, list | tuple) and any(is_dataclass(one) for one in value):
        for number, entry in enumerate(value, 1):
            yield from _parts(entry, f"{path} {number}")
    else:
        yield path, _text(value)


def _text(value: Any) -> str:
    """Return a short value in full, the digest of a longer one."""
    if isinstance(value, np.ndarray):
        return repr(value.tolist()) if value.size <= _SHOWN else digest(value)
    if isinstance(value, list | tuple) and len(value) > _SHOWN:
        return digest(value)
    return repr(value) if isinstance(value, float) else str(value)


def digest(value: Any) -> str:
    """Return a digest of a value made of dataclasses, lists, tuples, sets, arrays and plain values."""
    sha256 = hashlib.sha256()
    for byte in _bytes(value):
        sha256.update(byte)
    return f"#{sha256.hexdigest()[:DIGITS]}"


def _bytes(value: Any) -> Iterator[bytes]:
    """Yield the content of a value with the types and sizes of its parts, so that no two values yield the same."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype.str}{value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif is_dataclass(value):
        yield type(value).__name__.encode()
        yield from _bytes([getattr(value, field.name) for field in fields(value)])
    elif isinstance(value, list | tuple):
        yield f"({len(value)}".encode()
        for entry in value:
            yield from _bytes(entry)
    elif isinstance(value, frozenset):
        yield from _bytes(sorted(value))
    else:
        yield f"{type(value).__name__} {value!r};".encode()
