"""A building of many stones in a database, with all that can be known of it, for `benchmarks.query`."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.declare import declare_phase
from archmodel.assertions.statements import say_mason_mark, say_of_phase
from archmodel.database.session import Database
from archmodel.store.find_by_code import Subjects
from archmodel.store.run_record import ContactArrays, ErrorMeasures, JointArrays, RunRecord, StoneResult
from archmodel.store.runs import store_run
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from archmodel.tables.relations import Relation
from mechanics.arrays import Array, Ints
from pipelines.ingest.relate import relate

__all__ = ["COURSES", "RUNS", "relate_all", "store_all_stones", "store_knowledge", "store_results"]

COURSES = 100
RUNS = 12
_HEIGHT, _GAP, _POINTS = 0.29, 0.01, 10
_ARCH_STONES = 15
_EVERY = 2000  # stones for each arch


# --- the stones: a wall in running bond of headers and stretchers, and free arches before it ---


def store_all_stones(database: Database, count: int) -> None:
    """Take them in as one survey."""
    with database.session() as session:
        store_survey(session, "building", "building.moma", f"{count:064x}", _stones(count))


def _stones(count: int) -> Iterator[StoneRecord]:
    rng = np.random.default_rng(5)
    arches = count // _EVERY
    in_wall = count - arches * _ARCH_STONES
    for number in range(in_wall):
        course, place = divmod(number, in_wall // COURSES)
        header = (place + course) % 2 == 0
        x = 0.45 * place + (0.15 if header else 0.0)
        length = 0.29 if header else 0.59
        low, high = (_HEIGHT + _GAP) * course, (_HEIGHT + _GAP) * course + _HEIGHT
        face = np.array([[x, 0, low], [x + length, 0, low], [x + length, 0, high], [x, 0, high]])
        depth = float(rng.uniform(0.5, 0.7) if header else rng.uniform(0.25, 0.35))
        code = f"W{course + 1}-{place + 1}"
        yield _stone(rng, code, "header" if header else "stretcher", course + 1, face, depth)
    for arch in range(arches):
        yield from _arch(rng, arch)


def _arch(rng: np.random.Generator, arch: int) -> Iterator[StoneRecord]:
    """A semicircle of stones, 10 m before the wall, joints of 10 mm."""
    bounds = np.linspace(math.pi, 0.0, _ARCH_STONES + 1)
    for place, (left, right) in enumerate(pairwise(bounds.tolist())):
        left, right = left - 0.004, right + 0.004
        directions = np.array(
            [[math.cos(angle), 0.0, math.sin(angle)] for angle in (left, right, right, left)]
        )
        face = directions * np.array([1.0, 1.0, 1.4, 1.4])[:, None] + [4.0 * arch, -10.0, 0.0]
        last = place in (0, _ARCH_STONES - 1)
        kind = "springer" if last else "keystone" if place == _ARCH_STONES // 2 else "voussoir"
        yield _stone(rng, f"A{arch + 1}-{place + 1}", kind, None, face, 0.45)


def _stone(
    rng: np.random.Generator, code: str, kind: str, course: int | None, face: Array, depth: float
) -> StoneRecord:
    """A prism behind a face (4, 3) that is seen from the side of negative y."""
    middle = face.mean(axis=0)
    points = middle + rng.uniform(-0.1, 0.1, (_POINTS, 3)) * [1.0, 0.02, 1.0]
    return StoneRecord(
        code=code,
        kind=kind,
        course=course,
        line=1,
        vertices=face,
        points=points,
        sigma=0.003,
        normal=np.array([0.0, -1.0, 0.0]),
        offset=-float(middle[1]),
        centroid=middle,
        axes=np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
        covariance=np.diag([4e-6, 9e-6, 1e-6]),
        rms=0.002,
        redundancy=_POINTS - 3,
        rejected=(),
        outline=face,
        depth=depth,
        depth_sigma=0.03,
        depth_source="rule of the benchmark",
        solid_vertices=np.vstack([face, face + np.array([0.0, depth, 0.0])]),
        solid_faces=((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
        vertex_sigma=np.full((8, 3), 0.003),
        length=float(np.ptp(face[:, 0])),
        height=float(np.ptp(face[:, 2])),
        area=float(np.ptp(face[:, 0]) * np.ptp(face[:, 2])),
        zone="wall" if course is not None else "arches",
    )


# --- what follows from them, and what is known besides ---


def relate_all(database: Database, count: int) -> None:
    """Relations, courses and arches from the geometry."""
    with database.session() as session:
        relate(session)


def store_knowledge(database: Database, count: int) -> None:
    """Phases of the lowest 90 courses, a third each; a mason mark on every 19th stone."""
    with database.session() as session:
        entry = new_entry(session, "declaration", "the benchmark")
        for phase in (1, 2, 3):
            declare_phase(session, entry, str(phase), 1200 + 100 * phase, 1250 + 100 * phase)
            low, high = 30 * phase - 29, 30 * phase
            numbers = session.scalars(select(Entity.id).where(Entity.course.between(low, high))).all()
            say_of_phase(session, entry, Subjects(tuple(numbers)), str(phase))
        numbers = session.scalars(select(Entity.id).where(Entity.id % 19 == 3)).all()
        for sign in range(5):
            say_mason_mark(session, entry, Subjects(tuple(numbers[sign::5])), f"sign {sign + 1}")


def store_results(database: Database, count: int) -> None:
    """Runs with results of all stones; the last with its joints, and four contact points in each."""
    rng = np.random.default_rng(6)
    with database.session(read_only=True) as session:
        codes = list(session.scalars(select(Entity.code).order_by(Entity.id)))
        pairs = _touching(session)
    for run in range(1, RUNS + 1):
        stresses, values = rng.lognormal(12.0, 1.2, count).tolist(), rng.random((count, 3)).tolist()
        results = tuple(
            StoneResult(code, "deformable", stress, stress / 4, 1e-5 * more[0], 2e3 * more[1], _values(more))
            for code, stress, more in zip(codes, stresses, values, strict=True)
        )
        record = RunRecord(
            scene="benchmark",
            scene_text='[scene]\nname = "benchmark"\n',
            outcome="equilibrium",
            summary={},
            versions={"moma": "benchmark"},
            results=results,
            errors=ErrorMeasures(1e-7, 1e-9, 1e-6, 1e-7, 1e-6),
            joints=_joints(pairs, rng) if run == RUNS else None,
            contacts=_contacts(pairs, rng) if run == RUNS else None,
        )
        with database.session() as session:
            store_run(session, record)


def _values(more: list[float]) -> dict[str, float]:
    return {"joint_pressure": 1e5 * more[0], "joint_kern": 2.0 * more[1], "joint_opening": 1e-4 * more[2]}


def _touching(session: Session) -> Ints:
    """(n, 2) pairs of stones that have a joint, as indices from 0."""
    rows = session.execute(
        select(Relation.subject_id, Relation.object_id).where(Relation.kind.in_(("rests_on", "beside")))
    )
    numbers = np.array([tuple(row) for row in rows], dtype=np.int64).reshape(-1, 2)
    return numbers - 1  # in a new database stones are numbered from 1


def _joints(pairs: Ints, rng: np.random.Generator) -> JointArrays:
    count = len(pairs)
    names = "area force_normal force_shear pressure_mean pressure_max friction_use slipping open gap opening sliding"
    return JointArrays(
        stones=pairs,
        centroid=rng.random((count, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
        parted=np.zeros(count, dtype=bool),
        kern=np.where(rng.random(count) < 0.1, np.nan, 2.0 * rng.random(count)),
        **{name: rng.random(count) for name in names.split()},
    )


def _contacts(pairs: Ints, rng: np.random.Generator) -> ContactArrays:
    count = 4 * len(pairs)
    return ContactArrays(
        stones=np.repeat(pairs, 4, axis=0),
        joint=np.arange(count) // 4,
        point=rng.random((count, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
        force=rng.random((count, 3)),
        area=rng.random(count),
        gap=rng.random(count),
        opening=rng.random(count),
        slide=rng.random(count),
        status=np.array(["stick", "slip", "open"])[rng.integers(0, 3, count)],
    )
