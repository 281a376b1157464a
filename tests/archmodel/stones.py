"""Stones whose every number is known in closed form, and the contents of a database as text."""

from collections.abc import Iterable, Mapping
from contextlib import nullcontext

import numpy as np
from sqlalchemy import MetaData, select

from archmodel.database.session import Database, open_database
from archmodel.store.run_record import RunRecord, StoneResult
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import store_survey

SHA = "ab" * 32

BOX_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))


def store(into: Database | str, stones: Iterable[StoneRecord], survey: str = "wall") -> None:
    """Store stones as one survey in a database, or in the one of a URL."""
    opened = open_database(into) if isinstance(into, str) else nullcontext(into)
    with opened as database, database.session() as session:
        store_survey(session, survey, f"{survey}.moma", SHA, stones)


def box_stone(
    code: str,
    kind: str = "header",
    *,
    course: int | None = 1,
    size: tuple[float, float, float] = (0.6, 0.4, 0.3),
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
    line: int = 7,
    rejected: tuple[int, ...] = (),
) -> StoneRecord:
    """A box of size (length, depth, height), seen from the side of negative y, lowest corner `at`."""
    length, depth, height = size
    face = np.array([[0.0, 0, 0], [length, 0, 0], [length, 0, height], [0, 0, height]]) + at
    back = face + np.array([0.0, depth, 0.0])
    points = face.mean(axis=0) + np.random.default_rng(abs(hash_of(code))).normal(0.0, 0.05, (9, 3)) * [
        1,
        0,
        1,
    ]
    return StoneRecord(
        code=code,
        kind=kind,
        course=course,
        line=line,
        vertices=face + 1e-3,
        points=points,
        sigma=0.003,
        normal=np.array([0.0, -1.0, 0.0]),
        offset=-at[1],
        centroid=face.mean(axis=0),
        axes=np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
        covariance=np.diag([4e-6, 9e-6, 1e-6]),
        rms=0.0025,
        redundancy=6 - len(rejected),
        rejected=rejected,
        outline=face,
        length=length,
        height=height,
        area=length * height,
        depth=depth,
        depth_sigma=0.03,
        depth_source="measured in the breach of the tower",
        solid_vertices=np.vstack([face, back]),
        solid_faces=BOX_FACES,
        vertex_sigma=np.full((8, 3), 0.003),
        notes={"edge": "eroded", "remark": "façade · 2nd campaign"},
    )


def hash_of(code: str) -> int:
    """The same number for the same code in every process."""
    return int.from_bytes(code.encode()[:6], "big")


def run_record(
    results: dict[str, float | None],
    scene: str = "window",
    values: Mapping[str, Mapping[str, float]] | None = None,
) -> RunRecord:
    """A run with the given largest Von Mises stress by code, None for a rigid stone, and further values by code."""
    return RunRecord(
        scene=scene,
        scene_text=f'name = "{scene}"\n',
        outcome="equilibrium",
        summary={"scene": scene, "contacts": 12, "von_mises": None},
        versions={"moma": "0.1.0"},
        results=tuple(
            StoneResult(
                code=code,
                fidelity="rigid" if stress is None else "deformable",
                von_mises_p99=stress,
                von_mises_max=stress,
                von_mises_mean=None if stress is None else stress / 4,
                displacement_max=1e-5,
                contact_force_max=1250.0,
                values={"weight": 900.5, **(values or {}).get(code, {})},
            )
            for code, stress in results.items()
        ),
    )


def contents(database: Database) -> str:
    """Everything in the database: of each table every row, in the order of the keys."""
    lines = []
    with database.session(read_only=True) as session:
        connection = session.connection()
        found = MetaData()
        found.reflect(connection)
        for table in found.sorted_tables:
            lines.append(f"-- {table.name}: {', '.join(column.name for column in table.columns)}")
            lines += sorted(repr(tuple(row)) for row in connection.execute(select(table)))
    return "\n".join(lines)
