"""DXF: faces as closed polylines in their planes, by kind and phase, solids as meshes, codes as extended data."""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from archmodel.store.stone_arrays import Faces
from mechanics.arrays import Array
from pipelines.record.export.building import Building
from survey.clouds.extras import optional

APPLICATION = "MOMA"
"""Name under which entities carry the code of their stone."""

_CHUNK = 60
"""Characters in one string of extended data: it holds 255 bytes, and a character takes up to four."""

_FORBIDDEN = str.maketrans(dict.fromkeys('<>/\\":;?*|=`,', "_"))
"""Characters that names of layers may not have."""

_CONTROL = str.maketrans({"\n": "^J", "\r": "^M", "\t": "^I", "\0": "^@"})
"""Characters that would end a line, as AutoCAD writes them."""

_EMPTY = "  2\nENTITIES\n"
"""The section that ezdxf writes without entities, as there are none in the drawing."""


def dxf_content(building: Building) -> bytes:
    """Return a building as a drawing in metres, in the frame of the site.

    ezdxf writes the frame of the drawing; objects of its own for the entities would take four times as long.

    Raises
    ------
    UsageError : ezdxf is not installed
    """
    ezdxf = optional("ezdxf", "DXF files")
    from ezdxf.math import OCS

    entities: list[tuple[str, str, str]] = []  # head, layer, body
    phases = building.values("phase")
    forms: dict[tuple[int, ...], str] = {}
    for row, code in enumerate(building.codes):
        kind, phase = building.kinds[row], phases[row]
        outline, normal = building.outlines[row], building.normals[row]
        tags = _tags(code)
        if outline is not None and normal is not None:
            layer = _layer("ELEVATION", kind, None if phase is None else str(phase))
            entities.append(("LWPOLYLINE", layer, _polyline(OCS(tuple(normal.tolist())), outline) + tags))
        vertices, faces = building.shapes[row]
        entities.append(("MESH", _layer("SOLID", kind), _mesh(vertices, faces, forms) + tags))
    with _fixed(ezdxf):
        return _drawing(ezdxf, entities).encode("utf-8")


def _drawing(ezdxf: Any, entities: Sequence[tuple[str, str, str]]) -> str:
    """Return a drawing with these entities: type, layer, and what follows both."""
    drawing = ezdxf.new("R2010", units=6)  # metres
    drawing.appids.add(APPLICATION)
    for layer in sorted({layer for _, layer, _ in entities}):
        drawing.layers.add(layer)
    # in an order that does not depend on the process
    for name in sorted(drawing.entitydb.dxf_types_in_use()):
        drawing.classes.add_class(name)
    first, space = int(str(drawing.entitydb.handles), 16), drawing.modelspace().layout_key
    drawing.entitydb.handles.reset(f"{first + len(entities):X}")
    stream = io.StringIO()
    drawing.write(stream)
    before, section, after = stream.getvalue().partition(_EMPTY)
    lines = (
        f"  0\n{kind}\n  5\n{handle:X}\n330\n{space}\n100\nAcDbEntity\n  8\n{layer}\n{body}"
        for handle, (kind, layer, body) in enumerate(entities, first)
    )
    return "".join((before, section, *lines, after))


def _tags(code: str) -> str:
    """Return the code as extended data, in as many strings as it takes."""
    parts = (code[start : start + _CHUNK] for start in range(0, max(len(code), 1), _CHUNK))
    return f"1001\n{APPLICATION}\n" + "".join(f"1000\n{part.translate(_CONTROL)}\n" for part in parts)


def _polyline(plane: Any, outline: Array) -> str:
    """Return a closed polyline in a plane."""
    corners = list(plane.points_from_wcs(outline.tolist()))
    places = "".join(f" 10\n{corner.x!r}\n 20\n{corner.y!r}\n" for corner in corners)
    x, y, z = plane.uz
    return (
        f"100\nAcDbPolyline\n 90\n{len(corners)}\n 70\n1\n 38\n{corners[0].z!r}\n{places}"
        f"210\n{x!r}\n220\n{y!r}\n230\n{z!r}\n"
    )


def _mesh(vertices: Array, faces: Faces, forms: dict[tuple[int, ...], str]) -> str:
    """Return a mesh; `forms` keeps those of stones with the same faces, without coordinates."""
    numbers = tuple(number for face in faces for number in (len(face), *face))
    key = (len(vertices), *numbers)
    if key not in forms:
        forms[key] = _mesh_form(*key)
    return forms[key] % tuple(vertices.ravel().tolist())


def _mesh_form(count: int, *numbers: int) -> str:
    """Return a mesh with places for the coordinates of its vertices; version 2, not smoothed, no creases."""
    return (
        f"100\nAcDbSubDMesh\n 71\n2\n 72\n0\n 91\n0\n 92\n{count}\n"
        + " 10\n%r\n 20\n%r\n 30\n%r\n" * count
        + f" 93\n{len(numbers)}\n"
        + "".join(f" 90\n{number}\n" for number in numbers)
        + " 94\n0\n 95\n0\n 90\n0\n"
    )


def _layer(*words: str | None) -> str:
    """Return the name of a layer."""
    return "-".join(word.translate(_FORBIDDEN) for word in words if word)[:255]


@contextmanager
def _fixed(ezdxf: Any) -> Iterator[None]:
    """Have ezdxf write no time and no random identifiers, so that the same building gives the same bytes."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
