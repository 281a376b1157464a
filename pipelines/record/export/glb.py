"""glTF in its binary form: one mesh whose features are the stones, with a table of their properties.

Positions are relative to the middle of the building and in float32, as glTF has no other; the table has volume and
centroid in float64.
"""

import json
import math
import struct
from collections.abc import Sequence
from enum import IntEnum
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.record.export.building import Building, Value, plain_values

_ABSENT = -float(np.finfo(np.float64).max)
"""Number that stands for no value: JSON has no NaN."""

_EIGHTH = math.sqrt(1 / 2)  # cosine and sine of 45°
_UPWARDS = [-_EIGHTH, 0.0, 0.0, _EIGHTH]
"""Rotation that turns z, which is upwards here, to y, which is upwards in glTF."""


class _Gl(IntEnum):
    """Numbers of OpenGL: types of components, and targets of views."""

    UNSIGNED_INT, FLOAT = 5125, 5126
    ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


class _Chunks:
    """The binary part in the making, with the views on it."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []
        self.size = 0

    def view(self, data: bytes, target: int | None = None) -> int:
        """Add bytes, and return the number of the view on them."""
        place = {"buffer": 0, "byteOffset": self.size, "byteLength": len(data)}
        self.views.append(place if target is None else place | {"target": target})
        padded = data + b"\0" * (-len(data) % 8)
        self.parts.append(padded)
        self.size += len(padded)
        return len(self.views) - 1

    def accessor(self, array: NDArray[Any], kind: str, target: int) -> int:
        """Add an array, and return the number of the accessor to it."""
        component = _Gl.FLOAT if array.dtype == np.float32 else _Gl.UNSIGNED_INT
        accessor: dict[str, Any] = {
            "bufferView": self.view(array.tobytes(), target),
            "componentType": component,
            "count": len(array),
            "type": kind,
        }
        if kind == "VEC3":
            accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def glb_content(building: Building) -> bytes:
    """Return a building as a GLB file."""
    chunks = _Chunks()
    mesh = building.mesh
    origin = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    position = chunks.accessor((mesh.vertices - origin).astype("<f4"), "VEC3", _Gl.ARRAY_BUFFER)
    # numbers of features are exact in float32 up to 16,777,216
    feature = chunks.accessor(mesh.owner.astype("<f4"), "SCALAR", _Gl.ARRAY_BUFFER)
    indices = chunks.accessor(mesh.triangles.astype("<u4").ravel(), "SCALAR", _Gl.ELEMENT_ARRAY_BUFFER)
    schema, properties = _table(building, chunks)
    count = len(building.codes)
    features = {"featureIds": [{"featureCount": count, "attribute": 0, "propertyTable": 0}]}
    x, y, z = origin.tolist()
    document = {
        "asset": {"version": "2.0", "generator": f"MOMA {version('moma-masonry')}"},
        "extensionsUsed": ["EXT_mesh_features", "EXT_structural_metadata"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": building.title, "mesh": 0, "rotation": _UPWARDS, "translation": [x, z, -y]},
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": position, "_FEATURE_ID_0": feature},
                        "indices": indices,
                        "mode": 4,
                        "extensions": {"EXT_mesh_features": features},
                    }
                ]
            }
        ],
        "extensions": {
            "EXT_structural_metadata": {
                "schema": {"id": "moma", "classes": {"stone": {"properties": schema}}},
                "propertyTables": [{"class": "stone", "count": count, "properties": properties}],
            }
        },
        "bufferViews": chunks.views,
        "accessors": chunks.accessors,
        "buffers": [{"byteLength": chunks.size}],
    }
    return _packed(document, b"".join(chunks.parts))


def _table(building: Building, chunks: _Chunks) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the schema of the properties, and the views on their values."""
    schema: dict[str, Any] = {}
    properties: dict[str, Any] = {}

    def texts(name: str, values: Sequence[Value]) -> None:
        """Add a column of texts."""
        raw = ["" if value is None else str(value) for value in values]
        coded = [text.encode() for text in raw]
        ends = np.concatenate([[0], np.cumsum([len(code) for code in coded])]).astype("<u4")
        schema[name] = {"type": "STRING", "noData": ""}
        # a view of no bytes is not allowed
        properties[name] = {
            "values": chunks.view(b"".join(coded) or b"\0"),
            "stringOffsets": chunks.view(ends.tobytes()),
        }

    def numbers(name: str, values: Sequence[Value], unit: str | None) -> None:
        """Add a column of numbers."""
        array = np.array([_ABSENT if value is None else value for value in values], dtype="<f8")
        schema[name] = {"type": "SCALAR", "componentType": "FLOAT64", "noData": _ABSENT}
        if unit is not None:
            schema[name]["description"] = f"in {unit}"
        properties[name] = {"values": chunks.view(array.tobytes())}

    texts("code", building.codes)
    numbers("solid_volume", building.volumes.tolist(), "m³")
    for axis, name in enumerate("xyz"):
        numbers(f"centroid_{name}", building.centroids[:, axis].tolist(), "m")
    for column in building.columns:
        values = plain_values(column)
        if isinstance(column.values, np.ndarray):
            numbers(column.name, values, column.unit)
        else:
            texts(column.name, values)
    return schema, properties


def _packed(document: dict[str, Any], data: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<4sII", b"glTF", 2, size)
    return b"".join(
        [head, struct.pack("<I4s", len(text), b"JSON"), text, struct.pack("<I4s", len(data), b"BIN\0"), data]
    )
