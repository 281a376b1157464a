"""DXF: faces as closed polylines in their planes, by kind and phase, solids as meshes, codes as extended data."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pipelines.record.export.building import Building
from survey.clouds.extras import optional

__all__ = ["APPLICATION", "dxf_content"]

APPLICATION = "MOMA"
"""Name under which entities carry the code of their stone."""

_CHUNK = 60
"""Characters in one string of extended data: it holds 255 bytes, and a character takes up to four."""

_FORBIDDEN = str.maketrans(dict.fromkeys('<>/\\":;?*|=`,', "_"))
"""Characters that names of layers may not have."""


def dxf_content(building: Building) -> bytes:
    """Return a building as a drawing in metres, in the frame of the site.

    Raises
    ------
    UsageError : ezdxf is not installed
    """
    ezdxf = optional("ezdxf", "DXF files")
    from ezdxf.math import OCS

    with _fixed(ezdxf):
        drawing = ezdxf.new("R2010", units=6)  # metres
        drawing.appids.add(APPLICATION)
        space = drawing.modelspace()
        phases = building.values("phase")
        for row, code in enumerate(building.codes):
            kind, phase = building.kinds[row], phases[row]
            # as many strings as the code takes
            tags = [(1000, code[start : start + _CHUNK]) for start in range(0, max(len(code), 1), _CHUNK)]
            outline, normal = building.outlines[row], building.normals[row]
            if outline is not None and normal is not None:
                plane = OCS(tuple(normal.tolist()))
                corners = list(plane.points_from_wcs(outline.tolist()))
                layer = _layer("ELEVATION", kind, None if phase is None else str(phase))
                face = space.add_lwpolyline(
                    [(corner.x, corner.y) for corner in corners],
                    close=True,
                    dxfattribs={"layer": layer, "elevation": corners[0].z, "extrusion": plane.uz},
                )
                face.set_xdata(APPLICATION, tags)
            vertices, faces = building.shapes[row]
            mesh = space.add_mesh(dxfattribs={"layer": _layer("SOLID", kind)})
            with mesh.edit_data() as data:
                data.vertices = vertices.tolist()
                data.faces = [list(each) for each in faces]
            mesh.set_xdata(APPLICATION, tags)
        stream = io.StringIO()
        drawing.write(stream)
    return stream.getvalue().encode("utf-8")


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
