"""Relations of stones, from solids in a database to relations in it: on SQLite and PostgreSQL."""

from collections import Counter
from dataclasses import asdict, replace

import numpy as np
import pytest
from sqlalchemy import select, update
from sqlalchemy.orm import aliased

from archmodel.assertions.arrange import declare_structure
from archmodel.assertions.register_kind import register_kind
from archmodel.database.session import open_database
from archmodel.relations.classify import RelationSettings
from archmodel.relations.store import held_settings
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, held_at, new_entry
from archmodel.tables.knowledge import Correction
from archmodel.tables.relations import Membership, Relation
from archmodel.tables.structures import Structure
from archmodel.tables.surveys import Measurement
from ground.errors import UsageError
from pipelines.ingest import relate as relating
from pipelines.ingest.relate import KnownSolids, relate
from tests.archmodel.stones import box_stone
from tests.pipelines.ingest.standing_stones import FRONT, arch, stone, take_in, wall
from tests.validation import masonry


@pytest.fixture
def database(new_url):
    with open_database(new_url()) as opened:
        yield opened


def related(database, **options):
    with database.session() as session:
        return relate(session, **options)


def relations(database, as_of=None, **conditions):
    """{(kind, subject's code, object's code)} that are held."""
    subject, other = aliased(Entity), aliased(Entity)
    statement = (
        select(Relation.kind, subject.code, other.code)
        .join(subject, subject.id == Relation.subject_id)
        .join(other, other.id == Relation.object_id)
        .where(held_at(Relation, as_of))
    )
    with database.session(read_only=True) as session:
        found = [tuple(row) for row in session.execute(statement.filter_by(**conditions))]
    assert len(set(found)) == len(found)
    return set(found)


def of_kind(database, kind):
    return {(one, other) for name, one, other in relations(database) if name == kind}


def values(database, *names):
    """{code: values of attributes}."""
    columns = [Entity.__table__.c[name] for name in names]
    with database.session(read_only=True) as session:
        return {
            code: tuple(rest) for code, *rest in session.execute(select(Entity.__table__.c.code, *columns))
        }


def members(database, as_of=None):
    """{structure: [(code, rank)]}, by rank."""
    found = {}
    with database.session(read_only=True) as session:
        rows = session.execute(
            select(Structure.code, Entity.code, Membership.rank)
            .join(Membership, Membership.structure_id == Structure.id)
            .join(Entity, Entity.id == Membership.entity_id)
            .where(held_at(Membership, as_of))
            .order_by(Structure.code, Membership.rank, Entity.code)
        )
        for structure, code, rank in rows:
            found.setdefault(structure, []).append((code, rank))
    return found


def rows_of(database, *tables):
    with database.session(read_only=True) as session:
        return [
            sorted((tuple(row) for row in session.execute(select(table.__table__))), key=str)
            for table in tables
        ]


TABLES = (Entity, Entry, Relation, Structure, Membership, Correction)


def test_stones_of_a_running_bond_rest_on_those_below_and_stand_beside_each_other(database):
    take_in(database, wall(3, 3))
    report = related(database)
    # bonds from bottom to top: halves first (4 stones), 3 stones, 4 stones; stones are 0.6 m long
    ends = {1: [0, 0.5, 1.5, 2.5, 3], 2: [0, 1, 2, 3], 3: [0, 0.5, 1.5, 2.5, 3]}
    rests = {(f"1-{k}", "base") for k in (1, 2, 3, 4)}
    for row in (2, 3):
        for i in range(len(ends[row]) - 1):
            for j in range(len(ends[row - 1]) - 1):
                if min(ends[row][i + 1], ends[row - 1][j + 1]) > max(ends[row][i], ends[row - 1][j]):
                    rests.add((f"{row}-{i + 1}", f"{row - 1}-{j + 1}"))
    beside = {(f"{row}-{k}", f"{row}-{k + 1}") for row in ends for k in range(1, len(ends[row]) - 1)}
    assert of_kind(database, "rests_on") == rests
    assert of_kind(database, "beside") == beside
    assert len(relations(database)) == len(rests) + len(beside)
    assert report.relations["rests_on"].added == len(rests)
    assert report.relations["beside"].added == len(beside)
    assert report.stones == 12


def test_a_relation_has_the_numbers_of_its_joint(database):
    take_in(database, wall(2, 2))
    related(database)
    subject, other = aliased(Entity), aliased(Entity)
    with database.session(read_only=True) as session:
        one = session.scalar(
            select(Relation)
            .join(subject, subject.id == Relation.subject_id)
            .join(other, other.id == Relation.object_id)
            .where(subject.code == "2-1", other.code == "1-1")
        )
        # half a stone, 0.3 m, of the wall's 0.4 m; the wall goes from y = -0.2 to 0.2
        assert one.area == pytest.approx(0.12)
        assert (one.x, one.y, one.z) == pytest.approx((0.15, 0.0, 0.3))
        assert (one.nx, one.ny, one.nz) == pytest.approx((0.0, 0.0, 1.0))
        assert one.gap == pytest.approx(0.0, abs=1e-12)
        assert not one.declared
        assert one.entry.action == "geometry"
        assert one.entry.settings == asdict(RelationSettings())


def test_the_load_goes_from_the_keystone_down_both_sides_of_an_arch(database):
    take_in(database, arch(9))
    related(database)
    # V1 to V9 from the right springing to the left one; V5 is the keystone
    down = {(f"V{k + 1}", f"V{k}") for k in (1, 2, 3, 4)} | {(f"V{k}", f"V{k + 1}") for k in (5, 6, 7, 8)}
    assert of_kind(database, "rests_on") == down | {("V1", "right"), ("V9", "left")}
    assert of_kind(database, "beside") == set()


def test_the_two_middle_stones_of_an_even_arch_are_beside_each_other(database):
    take_in(database, arch(8))
    related(database)
    assert of_kind(database, "beside") == {("V4", "V5")}


def test_an_arch_stone_rests_on_a_skewback_that_is_no_stone_of_the_arch(database):
    stones = masonry.buttressed_arch()
    take_in(database, [stone(b, "voussoir" if b.code.startswith("V") else "ashlar") for b in stones])
    related(database)
    # springing 30° above the level: the joint's normal is 60° from the vertical
    assert {("V1", "right"), ("V12", "left")} <= of_kind(database, "rests_on")


def two_facings():
    """Outer and inner facing with a header of the outer one, in two courses; the wall is 0.5 m thick."""

    def box(code, kind, low, high, looks, course=1):
        return stone(masonry.cuboid(code, low, high), kind, looks=looks, course=course)

    back = -FRONT
    return [
        box("O1", "stretcher", (0, 0, 0), (1, 0.25, 0.3), FRONT),
        box("H", "header", (1, 0, 0), (1.3, 0.5, 0.3), FRONT),
        box("O2", "stretcher", (1.3, 0, 0), (2.3, 0.25, 0.3), FRONT),
        box("I1", "stretcher", (0, 0.25, 0), (1, 0.5, 0.3), back),
        box("I2", "stretcher", (1.3, 0.25, 0), (2.3, 0.5, 0.3), back),
        box("T", "header", (0.5, 0, 0.3), (0.8, 0.4, 0.6), FRONT, 2),
        box("B", "stretcher", (0.3, 0.4, 0.3), (1.1, 0.5, 0.6), back, 2),
    ]


def test_facings_are_bonded_by_what_reaches_into_the_other_one(database):
    take_in(database, two_facings())
    related(database)
    # the header H lies between the inner stretchers; T lies upon I1 with its tail, and touches B behind it;
    # B lies upon I1, O1 does not lie under it
    assert of_kind(database, "bonded_with") == {("H", "I1"), ("H", "I2"), ("I1", "T"), ("T", "B"), ("H", "B")}
    assert of_kind(database, "across_the_wall") == {("O1", "I1"), ("O2", "I2"), ("T", "B")}
    assert of_kind(database, "beside") == {("O1", "H"), ("H", "O2")}
    assert {("T", "O1"), ("T", "I1"), ("B", "I1")} <= of_kind(database, "rests_on")


def test_a_header_has_the_length_that_it_reaches_behind_the_stretchers_beside_it(database):
    take_in(database, two_facings())
    related(database)
    tails = {code: tail for code, (tail,) in values(database, "tail_length").items() if tail is not None}
    assert tails == pytest.approx({"H": 0.25})  # nothing is beside T


def test_quoins_are_bonded_with_the_stones_of_both_walls(database):
    side = np.array([-1.0, 0.0, 0.0])
    stones = [
        stone(masonry.cuboid("Q1", (0, 0, 0), (0.8, 0.4, 0.3)), "quoin", course=1),
        stone(masonry.cuboid("F1", (0.8, 0, 0), (1.4, 0.4, 0.3)), "stretcher", course=1),
        stone(masonry.cuboid("S1", (0, 0.4, 0), (0.4, 1.0, 0.3)), "stretcher", looks=side, course=1),
        stone(masonry.cuboid("Q2", (0, 0, 0.3), (0.4, 0.8, 0.6)), "quoin", looks=side, course=2),
        stone(masonry.cuboid("F2", (0.4, 0, 0.3), (1.2, 0.4, 0.6)), "stretcher", course=2),
    ]
    take_in(database, stones)
    related(database)
    assert of_kind(database, "bonded_with") == {
        ("Q1", "F1"),
        ("Q1", "S1"),
        ("Q1", "Q2"),  # they look along one wall each
        ("Q2", "F2"),
    }
    assert of_kind(database, "rests_on") == {("Q2", "Q1"), ("Q2", "S1"), ("F2", "Q1"), ("F2", "F1")}


def test_a_second_time_nothing_changes(database):
    take_in(database, [*wall(3, 3), *arch(at=(9.0, 0.0, 0.0)), *two_facings_elsewhere()])
    first = related(database)
    assert first.entry is not None
    before = rows_of(database, *TABLES)
    again = related(database)
    assert again.entry is None
    assert again.values == 0
    assert all(one.added == one.superseded == 0 for one in again.relations.values())
    assert again.memberships.kept == first.memberships.added
    assert rows_of(database, *TABLES) == before


def two_facings_elsewhere():
    """The two facings 20 m along x."""
    moved = []
    for one in two_facings():
        shift = np.array([20.0, 0.0, 0.0])
        moved.append(replace(one, solid_vertices=one.solid_vertices + shift, outline=one.outline + shift))
    return moved


def test_what_is_no_longer_found_is_superseded_and_can_be_read_back(database):
    take_in(database, wall(2, 2))
    first = related(database)
    before = relations(database)
    with database.session() as session:
        held = session.scalar(select(Measurement).join(Entity).where(Entity.code == "2-1"))
        held.solid_vertices = held.solid_vertices + np.array([0.0, 0.0, 5.0])  # it was never there
    second = related(database)
    gone = {one for one in before if "2-1" in one[1:]}
    assert relations(database) == before - gone
    assert relations(database, as_of=first.entry) == before
    assert sum(one.superseded for one in second.relations.values()) == len(gone) > 0
    assert sum(one.kept for one in second.relations.values()) == len(before - gone)


def test_later_stones_are_related_with_the_tolerances_of_last_time(database):
    take_in(database, wall(2, 2))
    settings = replace(RelationSettings(), width=0.06, arch=2.0)
    related(database, settings=settings)
    with database.session(read_only=True) as session:
        assert held_settings(session) == settings
    # beds 50 mm wide: too wide but for the tolerance of last time
    take_in(
        database,
        [box_stone("lower", at=(100.0, 0.0, 0.0)), box_stone("upper", at=(100.0, 0.0, 0.35))],
        "later",
    )
    report = related(database)
    with database.session(read_only=True) as session:
        assert session.get_one(Entry, report.entry).settings == asdict(settings)
    assert ("rests_on", "upper", "lower") in relations(database)


def test_declared_relations_are_left_alone_and_not_doubled(database):
    take_in(database, wall(2, 2))
    with database.session() as session:
        numbers = dict(session.execute(select(Entity.code, Entity.id)).all())
        entry = new_entry(session, "declaration", "seen on the scaffold", author="A. Mason")
        for kind, one, other in (("rests_on", "1-1", "base"), ("bonded_with", "1-1", "2-2")):
            session.add(
                Relation(
                    kind=kind,
                    subject_id=numbers[one],
                    object_id=numbers[other],
                    declared=True,
                    entry_id=entry.id,
                )
            )
    related(database)
    assert relations(database, declared=True) == {("rests_on", "1-1", "base"), ("bonded_with", "1-1", "2-2")}
    assert ("rests_on", "1-1", "base") not in relations(database, declared=False)
    assert related(database).entry is None


@pytest.mark.parametrize("handed_in", [False, True])
def test_stones_taken_in_later_come_to_stand_as_if_all_had_come_at_once(database, new_url, handed_in):
    stones = [*wall(4, 6), *arch(at=(2.0, 0.0, 9.0))]
    lower, upper = stones[:14], stones[14:]
    take_in(database, lower, "lower")
    related(database)
    take_in(database, upper, "upper")
    with database.session() as session:
        numbers = dict(session.execute(select(Entity.code, Entity.id)).all())
        only = [numbers[one.code] for one in upper]
        solids = None
        if handed_in:
            solids = KnownSolids()
            for one in upper:
                solids.add(numbers[one.code], one.solid_vertices, one.solid_faces)
        relate(session, only=only, solids=solids)
    with open_database(new_url()) as other:
        take_in(other, stones)
        related(other)
        assert relations(database) == relations(other)
        assert members(database) == members(other)
        assert values(database, "rank", "tail_length") == values(other, "rank", "tail_length")
    assert related(database).entry is None


def test_solids_that_are_handed_in_are_not_read_back(database, monkeypatch):
    stones = wall(3, 3)
    take_in(database, stones)

    def refuse(*_):
        raise AssertionError("read back")

    monkeypatch.setattr(relating, "stone_shapes", refuse)
    with database.session() as session:
        numbers = dict(session.execute(select(Entity.code, Entity.id)).all())
        solids = KnownSolids()
        for one in reversed(stones):
            solids.add(numbers[one.code], one.solid_vertices, one.solid_faces)
        report = relate(session, only=list(numbers.values()), solids=solids)
    # 4 stones on the base, two for each of the 3 in the second course; in the third, whole ones on two, halves on one
    assert report.relations["rests_on"].added == 4 + 6 + 6


def test_zones_and_courses_are_structures_and_stones_have_their_places_in_them(database):
    east = [replace(one, code=f"E{one.code}") for one in wall(2, 2)]
    loose = stone(masonry.cuboid("L", (9, 0, 0), (9.3, 0.3, 0.3)), "rubble", zone="north wall")
    take_in(database, [*wall(2, 2, zone="north wall"), loose, *east])
    related(database)
    found = members(database)
    assert found["north wall/course 1"] == [("1-1", 1), ("1-2", 2), ("1-3", 3)]
    assert found["course 2"] == [("E2-1", 1), ("E2-2", 2)]
    assert found["north wall"] == [("L", None)]
    with database.session(read_only=True) as session:
        course = session.scalar(select(Structure).where(Structure.code == "north wall/course 2"))
        assert (course.kind, course.number, course.parent.code) == ("course", 2, "north wall")
        assert course.parent.kind == "structure"
        assert session.scalar(select(Structure).where(Structure.code == "course 2")).parent is None


def test_a_stone_whose_course_is_corrected_moves_to_the_other_course(database):
    take_in(database, wall(2, 2))
    first = related(database)
    with database.session() as session:
        session.execute(update(Entity.__table__).where(Entity.code == "2-1").values(course=1))
    related(database)
    assert ("2-1", None) not in members(database)["course 2"]
    assert [code for code, _ in members(database)["course 2"]] == ["2-2"]
    assert {code for code, _ in members(database)["course 1"]} == {"1-1", "1-2", "1-3", "2-1"}
    assert [code for code, _ in members(database, first.entry)["course 2"]] == ["2-1", "2-2"]


@pytest.mark.parametrize("zone", [None, "north wall"])
def test_a_stone_that_is_corrected_alone_leaves_all_as_if_all_were_computed_again(database, zone):
    take_in(database, wall(3, 3, zone=zone))
    related(database)
    with database.session() as session:
        moved = session.scalar(select(Entity.id).where(Entity.code == "1-2"))
        session.execute(update(Entity.__table__).where(Entity.id == moved).values(course=2, kind="header"))
    assert related(database, only=[moved]).memberships.superseded > 0
    course = "course 1" if zone is None else f"{zone}/course 1"
    assert members(database)[course] == [("1-1", 1), ("1-3", 2), ("1-4", 3)]
    assert related(database).entry is None


def test_a_stone_without_a_solid_has_a_course_and_touches_nothing(database):
    take_in(database, wall(2, 2))
    with database.session() as session:
        entry = new_entry(session, "declaration", "seen on an old photograph")
        session.add(Entity(code="lost", course=2, entry_id=entry.id))
    related(database)
    assert ("lost", 3) in members(database)["course 2"]
    assert not [one for one in relations(database) if "lost" in one]
    with database.session() as session:
        lost = session.scalar(select(Entity.id).where(Entity.code == "lost"))
        session.execute(update(Entity.__table__).where(Entity.id == lost).values(course=1))
    related(database, only=[lost])
    assert ("lost", 4) in members(database)["course 1"]
    assert related(database).entry is None


def test_an_arch_is_a_row_from_its_left_springer_to_its_right_one(database):
    take_in(database, [*wall(3, 2), *arch(9, at=(9.0, 0.0, 0.0))])
    related(database)
    row = ["left", *(f"V{k}" for k in range(9, 0, -1)), "right"]
    assert members(database)["arch 1"] == [(code, rank) for rank, code in enumerate(row, start=1)]
    found = values(database, "ring", "rank", "intrados_angle")
    for rank, code in enumerate(row, start=1):
        assert found[code][:2] == (1, rank)
    for k in range(1, 10):
        assert found[f"V{k}"][2] == pytest.approx(np.pi / 9)
    assert found["left"][2] is None
    assert found["1-1"] == (None, None, None)


def test_rings_of_an_arch_are_counted_from_the_intrados(database):
    inner, outer = arch(9, 0.4, 1.5, "i"), arch(11, 0.4, 1.9, "o")
    take_in(database, [*outer, *inner])
    related(database)
    found = values(database, "ring", "rank")
    assert {found[f"iV{k}"][0] for k in range(1, 10)} == {1}
    assert {found[f"oV{k}"][0] for k in range(1, 12)} == {2}
    assert [found[f"oV{k}"][1] for k in range(11, 0, -1)] == list(range(2, 13))
    assert set(members(database)) == {"arch 1"}


def test_a_structure_whose_kind_is_told_better_keeps_its_members(database):
    loose = stone(masonry.cuboid("L", (5, 0, 0), (5.3, 0.3, 0.3)), "rubble", zone="south")
    take_in(database, [*wall(2, 2, zone="south"), loose, *arch(5, at=(9.0, 0.0, 0.0))])
    related(database)
    before = members(database)
    with database.session() as session:
        entry = new_entry(session, "declaration", "a test")
        register_kind(session, entry, "relieving_arch", "arch", "An arch in a wall, over a weaker place.")
        register_kind(session, entry, "plinth", "course", "A course that projects at the foot of a wall.")
        declare_structure(session, entry, "relieving_arch", "arch 1")
        declare_structure(session, entry, "plinth", "south/course 1")
        declare_structure(session, entry, "tower", "south")
    kept = rows_of(database, Structure, Membership)
    related(database)
    assert members(database) == before
    assert rows_of(database, Structure, Membership) == kept
    with database.session() as session:
        number = session.scalars(select(Entity.id).where(Entity.code == "1-1")).one()
    related(database, only=[number])
    assert rows_of(database, Structure, Membership) == kept


def test_two_arches_are_two_and_keep_their_names_when_a_third_comes(database):
    take_in(database, [*arch(7, prefix="a"), *arch(7, prefix="b", at=(6.0, 0.0, 0.0))], "two")
    related(database)
    before = members(database)
    assert [code for code, _ in before["arch 1"]] == ["aleft", *(f"aV{k}" for k in range(7, 0, -1)), "aright"]
    assert Counter(map(len, before.values())) == {9: 2}
    take_in(database, arch(7, prefix="c", at=(-6.0, 0.0, 0.0)), "third")
    related(database)
    after = members(database)
    assert {name: after[name] for name in before} == before
    assert {code[0] for code, _ in after["arch 3"]} == {"c"}


def test_declared_values_are_not_overwritten_and_computed_ones_are_corrected(database):
    take_in(database, two_facings())
    with database.session() as session:
        header = session.scalar(select(Entity).where(Entity.code == "H"))
        header.tail_length = 0.31
        entry = new_entry(session, "correction", "probed", author="A. Mason")
        session.add(
            Correction(
                entity_id=header.id, entry_id=entry.id, attribute="tail_length", before=None, after=0.31
            )
        )
    related(database)
    assert values(database, "tail_length")["H"] == (0.31,)


def test_a_computed_value_that_changes_leaves_the_former_one_behind(database):
    take_in(database, two_facings())
    related(database)
    with database.session() as session:
        session.execute(update(Entity.__table__).where(Entity.code == "H").values(depth=0.45))
    report = related(database)
    assert values(database, "tail_length")["H"] == (pytest.approx(0.20),)
    with database.session(read_only=True) as session:
        (correction,) = session.scalars(select(Correction))
        assert (correction.attribute, correction.entry_id) == ("tail_length", report.entry)
        assert (correction.before, correction.after) == (pytest.approx(0.25), pytest.approx(0.20))


def test_an_empty_database_has_nothing_to_relate(database):
    report = related(database)
    assert (report.stones, report.entry) == (0, None)


@pytest.mark.parametrize(
    "wrong", [{"width": -0.01}, {"width": float("nan")}, {"angle": 91.0}, {"share": 2.0}]
)
def test_tolerances_that_are_none_are_refused(wrong):
    with pytest.raises(UsageError, match=next(iter(wrong))):
        RelationSettings(**wrong)
