"""Packing of a model into one compressed text: a JSON head, then arrays, gzipped, in base64.

Layout of the bytes, little-endian: length of the head (uint32), the head, padding to 8, the arrays, each padded to 8.
The head holds the texts, and of each array its type, shape and place. Places are whole
steps, as differences from row to row. Poses are int16 with a
scale for each stone, as differences in time; columns are float32. The arrays of a head stand where it says
``{"array": number}``.
"""

import base64
import gzip
import json
import struct
from typing import Any

import numpy as np

from mechanics.arrays import Array
from pipelines.reports.page.model import Column, Joints, Mechanism, Model, Motion
from survey.conventions import FINEST, THINNEST

_LEVEL = 6  # of gzip
_FINE, _COARSE = THINNEST, FINEST  # steps of corners, and of measured points and corners of joints [m]
_STEPS = int(np.iinfo(np.int16).max)
_NAMES = {"float32": "f4", "int16": "i2", "int32": "i4", "uint8": "u1"}


class _Packer:
    """Arrays on their way into the bytes."""

    def __init__(self) -> None:
        self.entries: list[dict[str, Any]] = []
        self.parts: list[bytes] = []
        self._size = 0

    def add(self, values: Any, kind: str, **more: Any) -> dict[str, int]:
        """Append an array; return what stands for it in the head."""
        array = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
        data = array.tobytes()
        self.entries.append({"type": _NAMES[kind], "shape": list(array.shape), "at": self._size, **more})
        self.parts += [data, b"\0" * (-len(data) % 8)]
        self._size += len(data) + (-len(data) % 8)
        return {"array": len(self.entries) - 1}

    def indices(self, values: Any) -> dict[str, int]:
        """Append whole numbers (n, …) as differences between rows."""
        whole = np.asarray(values, dtype=np.int64)
        return self.add(np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1])), "int32", delta=True)

    def places(self, values: Any, step: float) -> dict[str, Any]:
        """Append places (n, 3) in whole steps [m], as differences between rows."""
        numbers = np.nan_to_num(np.asarray(values, dtype=float).reshape(-1, 3))
        return {"values": self.indices(np.rint(numbers / step)), "step": step}

    def steps(self, values: Array) -> dict[str, Any]:
        """Append a series (nf, n, k) as int16 with a scale for each of the n, in differences of time."""
        largest = np.abs(values).max(axis=(0, 2), initial=0.0)
        scale = np.where(largest > 0, largest / _STEPS, 1.0)
        whole = np.rint(np.nan_to_num(values) / scale[:, None]).astype(np.int64)
        differences = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))
        # modulo 2¹⁶: the reader adds up likewise
        wrapped = differences.astype(np.int16)
        return {"values": self.add(wrapped, "int16", delta=True), "scale": self.add(scale, "float32")}


def pack(model: Model) -> str:
    """Return the text of a model."""
    packer = _Packer()
    head = _head(model, packer)
    head["arrays"] = packer.entries
    text = json.dumps(head, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-(4 + len(text)) % 8)
    data = struct.pack("<I", len(text)) + text + b"".join(packer.parts)
    return base64.b64encode(gzip.compress(data, _LEVEL, mtime=0)).decode("ascii")


def _head(model: Model, packer: _Packer) -> dict[str, Any]:
    stones = model.stones
    head: dict[str, Any] = {
        "title": model.title,
        "codes": list(stones.codes),
        "vertices": packer.places(stones.vertices, _FINE),
        "owner": packer.indices(stones.owner),
        "triangles": packer.indices(stones.triangles),
        "edges": packer.indices(stones.edges),
        "columns": [_column(column, packer) for column in model.columns],
        "fields": [
            {
                "name": field.name,
                "label": field.label,
                "unit": field.unit,
                "values": packer.add(field.values, "float32"),
            }
            for field in model.fields
        ],
        "motion": None if model.motion is None else _motion(model.motion, packer),
        "joints": None if model.joints is None else _joints(model.joints, packer),
        "mechanisms": [_mechanism(mechanism, packer) for mechanism in model.mechanisms],
        "lines": [
            {
                "name": drawn.name,
                "colour": drawn.colour,
                "points": packer.places(np.concatenate([*drawn.lines, np.zeros((0, 3))]), _FINE),
                "counts": [len(line) for line in drawn.lines],
            }
            for drawn in model.lines
        ],
        "colour": model.colour,
        "towards": np.asarray(model.towards).tolist(),
        "origin": np.asarray(model.origin).tolist(),
        "axes": list(model.axes),
        "notes": list(model.notes),
    }
    if (points := model.points) is not None:
        head["points"] = {
            "places": packer.places(points.places, _COARSE),
            "owner": packer.indices(points.owner),
            "rejected": packer.add(points.rejected, "uint8"),
        }
    if (relations := model.relations) is not None:
        head["relations"] = {
            "pairs": packer.indices(relations.pairs),
            "kind": packer.add(relations.kind, "uint8"),
            "names": list(relations.names),
            "inverse": list(relations.inverse),
        }
    head["events"] = [[event.stone, event.when, event.who, event.what] for event in model.events]
    return head


def _column(column: Column, packer: _Packer) -> dict[str, Any]:
    """Describe a column; texts as numbers of a list of words."""
    record: dict[str, Any] = {
        "name": column.name,
        "label": column.label,
        "unit": column.unit,
        "group": column.group,
    }
    if column.unit is None:
        words = sorted({str(value) for value in column.values if value is not None})
        number = {word: index for index, word in enumerate(words)}
        rows = [-1 if value is None else number[str(value)] for value in column.values]
        return {**record, "words": words, "values": packer.add(rows, "int32")}
    return {**record, "values": packer.add(column.values, "float32")}


def _motion(motion: Motion, packer: _Packer) -> dict[str, Any]:
    return {
        "times": motion.times.tolist(),
        "centres": packer.add(motion.centres, "float32"),
        "shift": packer.steps(motion.shift),
        "turn": packer.steps(motion.turn),
        "supports": packer.add(motion.supports, "uint8"),
        "rest": None if motion.rest is None else packer.steps(motion.rest[None]),
        "values": [
            {"label": label, "unit": unit, "known": packer.add(np.isfinite(values).any(axis=0), "uint8")}
            | packer.steps(values[:, :, None])
            for label, unit, values in motion.values
        ],
    }


def _joints(joints: Joints, packer: _Packer) -> dict[str, Any]:
    return {
        "bodies": packer.indices(joints.bodies),
        "corners": packer.places(np.concatenate([*joints.polygons, np.zeros((0, 3))]), _COARSE),
        "counts": [len(polygon) for polygon in joints.polygons],
        "place": packer.add(joints.place, "float32"),
        "force": packer.add(joints.force, "float32"),
        "kern": packer.add(joints.kern, "float32"),
        "columns": [_column(column, packer) for column in joints.columns],
    }


def _mechanism(mechanism: Mechanism, packer: _Packer) -> dict[str, Any]:
    return {
        "name": mechanism.name,
        "about": mechanism.about,
        "centres": packer.add(mechanism.centres, "float32"),
        "velocity": packer.add(mechanism.velocity, "float32"),
        "joints": None if mechanism.joints is None else _joints(mechanism.joints, packer),
    }
