"""Walking along relations: load paths, neighbours, courses, stones near; on SQLite and PostgreSQL."""

import time
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import select

from archmodel.assertions.withdraw import withdraw_relations
from archmodel.database.as_known import as_known
from archmodel.database.session import open_database
from archmodel.relations.graph import carried_by, carries, courses_in_order, neighbours, stones_near
from archmodel.relations.load_paths import load_path
from archmodel.store.bulk import insert_rows
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from archmodel.tables.relations import Relation
from ground.errors import UsageError
from pipelines.ingest.relate import relate
from tests.pipelines.ingest.standing_stones import arch, take_in, wall


def stand(database, stones):
    take_in(database, stones)
    with database.session() as session:
        return relate(session).entry


def declare(database, kind, pairs):
    """Relations between stones by their codes, declared; number of the entry."""
    with database.session() as session:
        numbers = dict(session.execute(select(Entity.code, Entity.id)).all())
        entry = new_entry(session, "declaration", "seen")
        for one, other in pairs:
            session.add(
                Relation(
                    kind=kind,
                    subject_id=numbers[one],
                    object_id=numbers[other],
                    declared=True,
                    entry_id=entry.id,
                )
            )
        return entry.id


def asked(database, question, *arguments, at=None, **options):
    with database.session(read_only=True) as session, as_known(session, at) as then:
        return question(then, *arguments, **options)


def codes(found):
    return [one.code for one in found]


def below(code, ends):
    """The stones on which one of a running bond rests directly, by the ends of the stones of each course."""
    row, place = (int(part) for part in code.split("-"))
    if row == 1:
        return {"base"}
    a, b = ends[row][place - 1 : place + 1]
    return {
        f"{row - 1}-{k}" for k, (c, d) in enumerate(pairwise(ends[row - 1]), start=1) if min(b, d) > max(a, c)
    }


ENDS = {row: [0, 0.5, 1.5, 2.5, 3.5, 4] if row % 2 else [0, 1, 2, 3, 4] for row in range(1, 7)}


def test_the_load_path_is_all_that_is_below_by_levels(empty):
    stand(empty, wall(4, 6))
    path = asked(empty, load_path, "6-2")
    front, expected = {"6-2"}, {}
    for level in range(1, 7):
        through = {
            code: sorted(one for one in front if code in below(one, ENDS))
            for one in front
            for code in below(one, ENDS)
        }
        expected |= {code: (level, tuple(ones)) for code, ones in through.items()}
        front = set(through)
    assert {one.code: (one.level, tuple(sorted(one.through))) for one in path.stones} == expected
    assert [one.level for one in path.stones] == sorted(one.level for one in path.stones)
    assert codes(path.last) == ["base"]
    assert path.levels == 6
    assert (path.code, path.direction) == ("6-2", "down")


def test_upwards_it_is_all_that_rests_on_a_stone(empty):
    stand(empty, wall(4, 6))
    up = asked(empty, load_path, "2-2", up=True)
    with_it = {
        code
        for row in range(3, 7)
        for code in (f"{row}-{k}" for k in range(1, len(ENDS[row])))
        if "2-2" in codes(asked(empty, load_path, code).stones)
    }
    assert set(codes(up.stones)) == with_it
    assert all(one.code.startswith("6-") for one in up.last)


def test_the_load_of_an_arch_goes_down_both_sides(empty):
    stand(empty, arch(9))
    path = asked(empty, load_path, "V5")
    assert [(one.code, one.level, one.through) for one in path.stones if one.level <= 2] == [
        ("V4", 1, ("V5",)),
        ("V6", 1, ("V5",)),
        ("V3", 2, ("V4",)),
        ("V7", 2, ("V6",)),
    ]
    assert sorted(codes(path.last)) == ["left", "right"]


def test_a_stone_comes_after_all_through_which_its_load_comes(empty):
    stand(empty, wall(4, 6))
    declare(empty, "rests_on", [("6-2", "1-3")])  # a tie that skips courses
    path = asked(empty, load_path, "6-2")
    level = {one.code: one.level for one in path.stones} | {"6-2": 0}
    assert level["1-3"] == 5
    for one in path.stones:
        assert one.level == 1 + max(level[code] for code in one.through)


def test_stones_that_bear_one_another_in_a_circle_end_no_search(empty):
    stand(empty, wall(2, 3))
    declare(empty, "rests_on", [("1-1", "2-1"), ("2-1", "3-1")])
    path = asked(empty, load_path, "3-1")
    assert {"2-1", "1-1", "base"} <= set(codes(path.stones))
    assert len(set(codes(path.stones))) == len(path.stones)
    assert "3-1" not in codes(path.stones)


def test_what_a_stone_carries_and_is_carried_by(empty):
    stand(empty, wall(4, 3))
    assert codes(asked(empty, carries, "2-2")) == ["3-2", "3-3"]
    assert codes(asked(empty, carried_by, "2-2")) == ["1-2", "1-3"]
    assert asked(empty, carried_by, "base") == ()
    half = asked(empty, carried_by, "2-1")[0]
    assert (half.code, half.kind, half.relation, half.declared) == ("1-1", "stretcher", "rests_on", False)
    assert half.area == pytest.approx(0.3 * 0.4)


def test_neighbours_are_seen_from_the_stone_that_was_asked_for(empty):
    stand(empty, wall(4, 3))
    found = {(one.relation, one.code) for one in asked(empty, neighbours, "2-2")}
    assert found == {
        ("beside", "2-1"),
        ("beside", "2-3"),
        ("rests_on", "1-2"),
        ("rests_on", "1-3"),
        ("supports", "3-2"),
        ("supports", "3-3"),
    }


def test_a_relation_that_is_computed_and_declared_counts_once(empty):
    stand(empty, wall(2, 2))
    declare(empty, "rests_on", [("2-1", "1-1")])
    (one,) = [one for one in asked(empty, carried_by, "2-1") if one.code == "1-1"]
    assert one.declared
    assert one.area == pytest.approx(0.12)
    assert [one.through for one in asked(empty, load_path, "2-1").stones if one.code == "1-1"] == [("2-1",)]


def test_questions_can_be_asked_of_an_earlier_state(empty):
    first = stand(empty, wall(2, 2))
    second = declare(empty, "rests_on", [("1-1", "1-2")])
    assert "1-1" not in codes(asked(empty, carries, "1-2", at=first))
    assert "1-1" in codes(asked(empty, carries, "1-2", at=second))
    assert "1-2" not in codes(asked(empty, load_path, "1-1", at=first).stones)
    assert "1-2" in codes(asked(empty, load_path, "1-1").stones)
    assert asked(empty, load_path, "1-1", at=first - 1).stones == ()


def test_a_relation_that_was_withdrawn_is_on_no_path_and_between_no_neighbours(empty):
    """1-1 was said to rest on 1-2, and then not: paths and neighbours have it only at the entries between."""
    first = stand(empty, wall(2, 2))
    said = declare(empty, "rests_on", [("1-1", "1-2")])
    with empty.session() as session:
        numbers = dict(session.execute(select(Entity.code, Entity.id)).all())
        withdrawn = new_entry(session, "declaration", "seen better")
        withdraw_relations(session, withdrawn, "rests_on", [numbers["1-1"]], [numbers["1-2"]])
        entries = first, said, withdrawn.id, None
    for question, code, other, options in (
        (load_path, "1-1", "1-2", {}),
        (load_path, "1-2", "1-1", {"up": True}),
        (carried_by, "1-1", "1-2", {}),
        (carries, "1-2", "1-1", {}),
    ):
        found = [asked(empty, question, code, at=entry, **options) for entry in entries]
        known = [other in codes(one.stones if question is load_path else one) for one in found]
        assert known == [False, True, False, False]


def test_courses_come_by_zone_and_number_with_their_stones_from_left_to_right(empty):
    stand(empty, [*wall(2, 3, zone="north wall")])
    found = asked(empty, courses_in_order)
    assert [(one.code, one.zone, one.number) for one in found] == [
        (f"north wall/course {k}", "north wall", k) for k in range(4)
    ]
    assert found[1].stones == ("1-1", "1-2", "1-3")
    assert asked(empty, courses_in_order, "north wall") == found
    with pytest.raises(UsageError, match="did you mean north wall"):
        asked(empty, courses_in_order, "nort wall")


def test_stones_near_come_nearest_first(empty):
    stand(empty, wall(4, 3))
    # stones are 0.6 m long and 0.3 m high: neighbours in the course at 0.6 m, those above and below at √2·0.3 m
    found = asked(empty, stones_near, "2-2", 0.61)
    assert set(codes(found[:4])) == {"1-2", "1-3", "3-2", "3-3"}
    assert [one.distance for one in found] == pytest.approx([0.3 * 2**0.5] * 4 + [0.6] * 2)
    assert asked(empty, stones_near, "2-2", 0.0) == ()


@pytest.mark.parametrize("distance", [-1.0, float("nan"), float("inf")])
def test_a_distance_that_is_none_is_refused(empty, distance):
    with pytest.raises(UsageError, match="distance"):
        asked(empty, stones_near, "2-2", distance)


@pytest.mark.parametrize("question", [load_path, neighbours, carries, carried_by])
def test_a_stone_that_is_not_there_is_an_error_with_the_nearest(empty, question):
    take_in(empty, wall(2, 2))
    with pytest.raises(UsageError, match="did you mean base"):
        asked(empty, question, "bse")
    with pytest.raises(UsageError):
        asked(empty, question, "b\x00")


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)).filter(lambda p: p[0] != p[1]), max_size=25))
def test_of_any_relations_the_path_holds_what_can_be_reached(edges):
    with open_database("sqlite://") as database:
        with database.session() as session:
            entry = new_entry(session, "declaration", "any").id
            insert_rows(
                session,
                Entity,
                [
                    {"id": k + 1, "kind": "stone", "code": f"s{k}", "entry_id": entry, "hypothesis": False}
                    for k in range(8)
                ],
            )
            rows = [
                {
                    "kind": "rests_on",
                    "subject_id": a + 1,
                    "object_id": b + 1,
                    "declared": True,
                    "entry_id": entry,
                }
                for a, b in edges
            ]
            insert_rows(session, Relation, rows)
        path = asked(database, load_path, "s0")
    reached, front = set(), {0}
    while front:
        front = {b for a, b in edges if a in front} - reached
        reached |= front
    assert {int(one.code[1:]) for one in path.stones} == reached - {0}
    for one in path.stones:
        through = {f"s{a}" for a, b in edges if f"s{b}" == one.code and (a in reached or a == 0)}
        assert set(one.through) == through
        assert one.level >= 1


def fill(database, courses, across):
    """A running bond of entities and relations without solids."""
    with database.session() as session:
        entry = new_entry(session, "declaration", "made up").id
        insert_rows(
            session,
            Entity,
            (
                {
                    "id": row * across + k + 1,
                    "kind": "stretcher",
                    "hypothesis": False,
                    "code": f"{row + 1}-{k + 1}",
                    "entry_id": entry,
                    "course": row + 1,
                }
                for row in range(courses)
                for k in range(across)
            ),
        )
        pairs = (
            (row * across + k + 1, (row - 1) * across + other + 1)
            for row in range(1, courses)
            for k in range(across)
            for other in (k, k + 1 if row % 2 else k - 1)
            if 0 <= other < across
        )
        insert_rows(
            session,
            Relation,
            (
                {
                    "kind": "rests_on",
                    "subject_id": one,
                    "object_id": other,
                    "declared": False,
                    "entry_id": entry,
                }
                for one, other in pairs
            ),
        )


@pytest.fixture(scope="module")
def tall_wall(tmp_path_factory):
    """A wall of a hundred courses of a hundred stones."""
    with open_database(f"sqlite:///{tmp_path_factory.mktemp('tall') / 'wall.db'}") as database:
        fill(database, 100, 100)
        yield database


def test_a_load_path_widens_by_one_stone_in_every_course_down(tall_wall):
    path = asked(tall_wall, load_path, "100-50")
    assert len(path.stones) == sum(range(2, 101))
    assert path.levels == 99


@pytest.mark.slow
@pytest.mark.parametrize("across", [100, 1000], ids=["10,000 stones", "100,000 stones"])
def test_the_load_path_through_a_hundred_courses_takes_less_than_a_fifth_of_a_second_of_work(
    tmp_path, across
):
    with open_database(f"sqlite:///{tmp_path / 'wall.db'}") as database:
        fill(database, 100, across)
        spent = []
        for _ in range(3):
            start = time.process_time()
            asked(database, load_path, f"100-{across // 2}")
            spent.append(time.process_time() - start)
    assert min(spent) < 0.2


@pytest.mark.parametrize("question", [neighbours, load_path, carries, carried_by])
@pytest.mark.parametrize("entry", [-1, 0, 99])
def test_an_entry_that_is_not_there_is_an_error(filled, question, entry):
    with pytest.raises(UsageError, match=f"there is no entry {entry}; the last one is 1"):
        asked(filled, question, "V2", at=entry)


def test_courses_of_an_entry_that_is_not_there_are_an_error(filled):
    with pytest.raises(UsageError, match="there is no entry 99"):
        asked(filled, courses_in_order, at=99)
