"""Buildings of blocks in tests, made without a database."""

from datetime import UTC, datetime

import numpy as np

from pipelines.record.export.building import Building, Group
from pipelines.reports.page.model import Column
from pipelines.reports.page.surfaces import stones_of

HOSTILE = (
    *("W 01", "Straße-ä", "it's", 'a "b"', "back\\slash", "שלום", "مرحبا 7", "石", "𝔐", "<&>;,|"),
    "α'\\X2\\",
)

QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def made_building(codes, origin=(0.0, 0.0, 0.0)):
    """A wall of blocks of 0.6 × 0.4 × 0.3 m, a hundred a course, each a little askew."""
    count = len(codes)
    base = np.array([(x, y, z) for z in (0, 0.3) for x, y in ((0, 0), (0.6, 0), (0.6, 0.4), (0, 0.4))])
    place = np.arange(count)
    corner = np.column_stack([place % 100 * 0.6, 0 * place, place // 100 * 0.3]) + np.array(origin)
    # all sizes differ, so that no solid can stand for another
    size = 1 - 0.2 * (place % 97) / 97
    solids = corner[:, None] + base * size[:, None, None]
    volumes = 0.6 * 0.4 * 0.3 * size**3
    kinds = ["header" if row % 2 else "stretcher" for row in range(count)]
    texts = ["limestone" if row % 3 else None for row in range(count)]
    stresses = np.where(place % 2 == 0, 1e5 + place, np.nan)
    return Building(
        title="Wall's »end«",
        date=datetime(2026, 11, 21, 15, 40, tzinfo=UTC),
        codes=list(codes),
        kinds=kinds,
        shapes=[(solid, QUADS) for solid in solids],
        mesh=stones_of(list(codes), [(solid, QUADS) for solid in solids])[0],
        outlines=[solid[[0, 1, 5, 4]] if row % 5 else None for row, solid in enumerate(solids)],
        normals=[np.array([0.0, -1.0, 0.0]) if row % 5 else None for row in range(count)],
        volumes=volumes,
        centroids=solids.mean(axis=1),
        columns=(
            Column("kind", "kind", None, kinds, "Stone"),
            Column("depth", "depth", "m", 0.4 * size, "Depth"),
            Column("material", "material", None, texts, "Knowledge"),
            Column("von_mises_max", "von mises max", "Pa", stresses, "Results"),
        ),
        groups=(
            Group("wall", "wall", "the wall", None, ()),
            Group("course 1", "course", None, "wall", tuple(range(min(count, 100)))),
        ),
        materials={"limestone": {"density": (2350.0, "kg/m³"), "young": (12e9, "Pa")}},
        run=None,
        outcome=None,
    )
