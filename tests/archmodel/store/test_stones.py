from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from archmodel.database.session import Database
from archmodel.query.api import find
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import load_stones, store_survey, survey_with_hash
from ground.errors import DatabaseError, GeometryError, MomaError, SurveyError
from tests.archmodel.stones import SHA, box_stone, contents, store

OTHER = "cd" * 32


def assert_same(got: StoneRecord, want: StoneRecord) -> None:
    """Equal field by field, arrays to the last bit."""
    for name, value in vars(want).items():
        if isinstance(value, np.ndarray):
            assert getattr(got, name).tobytes() == value.astype(float).tobytes(), name
            assert getattr(got, name).shape == value.shape, name
        else:
            assert getattr(got, name) == value, name


def test_stones_come_back_bit_for_bit(filled: Database, wall: tuple[StoneRecord, ...]) -> None:
    with filled.session(read_only=True) as session:
        for got, want in zip(load_stones(session, find(session, "entity")), wall, strict=True):
            assert_same(got, want)


def test_stones_come_back_in_the_order_asked_for(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        stones = find(session, "entity")[::-1]
        assert [r.code for r in load_stones(session, [*stones, stones[0]])] == [
            *[s.code for s in stones],
            stones[0].code,
        ]


def test_loaded_arrays_belong_to_the_caller(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        (stone,) = load_stones(session, find(session, "keystone"))
        stone.points[0] = 7.0
        (again,) = load_stones(session, find(session, "keystone"))
        assert again.points[0, 0] != 7.0


def test_entities_can_be_loaded_in_a_later_session(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        stones = find(session, "voussoir")
    with filled.session(read_only=True) as session:
        assert [r.code for r in load_stones(session, stones)] == ["V1", "V2", "V3"]


def test_more_stones_than_one_statement_holds(empty: Database) -> None:
    stones = [box_stone(f"S{i}") for i in range(1201)]
    store(empty, iter(stones), "big")
    with empty.session(read_only=True) as session:
        loaded = load_stones(session, find(session, "entity"))
    assert [r.code for r in loaded] == [f"S{i}" for i in range(1201)]
    assert_same(loaded[1100], stones[1100])


def test_a_survey_is_found_by_the_hash_of_its_file(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        survey = survey_with_hash(session, SHA)
        assert survey is not None
        assert (survey.name, survey.path) == ("window", "window.moma")
        assert survey_with_hash(session, OTHER) is None


def test_stations_and_frame_are_kept(empty: Database) -> None:
    with empty.session() as session:
        store_survey(
            session,
            "a",
            "a.moma",
            SHA,
            [box_stone("A")],
            stations={"T1": [1.0, 2.0, 3.0]},
            frame={"scale": 1.5},
        )
    with empty.session(read_only=True) as session:
        survey = survey_with_hash(session, SHA)
        assert survey is not None
        assert survey.stations == {"T1": [1.0, 2.0, 3.0]}
        assert survey.frame == {"scale": 1.5}


NAN = float("nan")
BAD = box_stone("BAD", line=42)
REFUSED = [
    (
        replace(BAD, code="A1", line=9),
        DatabaseError,
        r"new\.moma:9: the code A1 is taken by the stone at new\.moma:7",
    ),
    (
        replace(BAD, code="V1"),
        DatabaseError,
        r"new\.moma:42: the code V1 is taken by the stone at window\.moma:7",
    ),
    (
        replace(BAD, kind="hedaer"),
        SurveyError,
        r"new\.moma:42 stone BAD: unknown kind 'hedaer'; did you mean header",
    ),
    (replace(BAD, code=""), SurveyError, "no visible character"),
    (replace(BAD, code="A\n"), SurveyError, "no visible character"),
    (replace(BAD, depth=NAN), SurveyError, "depth is nan"),
    (replace(BAD, depth_sigma=-0.1), SurveyError, r"depth_sigma is -0\.1"),
    (replace(BAD, rms=float("inf")), SurveyError, "rms is inf"),
    (
        replace(BAD, points=np.full((4, 3), NAN)),
        SurveyError,
        "points has a coordinate that is not a finite number",
    ),
    (replace(BAD, points=np.zeros((4, 2))), SurveyError, r"points has shape \(4, 2\), expected \(-1, 3\)"),
    (replace(BAD, covariance=np.zeros((2, 2))), SurveyError, "covariance has shape"),
    (replace(BAD, rejected=(99,)), SurveyError, "rejected point 99 of 9 points"),
    (replace(BAD, solid_faces=((0, 1, 99),)), GeometryError, "not a polygon on its 8 vertices"),
    (replace(BAD, solid_faces=()), GeometryError, "volume of the solid is 0"),
    (
        replace(BAD, solid_faces=tuple(f[::-1] for f in BAD.solid_faces)),
        GeometryError,
        "volume of the solid is -",
    ),
]


@pytest.mark.parametrize(("bad", "error", "message"), REFUSED)
def test_one_bad_stone_refuses_the_whole_file(
    filled: Database, bad: StoneRecord, error: type[MomaError], message: str
) -> None:
    before = contents(filled)
    good = [box_stone(f"A{i}") for i in range(700)]  # more than one batch, so that rows were written already
    with pytest.raises(error, match=message), filled.session() as session:
        store_survey(session, "new", "new.moma", OTHER, [*good, bad])
    assert contents(filled) == before


def test_a_caught_failure_leaves_nothing_of_the_file_in_the_session(filled: Database) -> None:
    before = contents(filled)
    with filled.session() as session:
        with pytest.raises(DatabaseError):
            store_survey(session, "new", "new.moma", OTHER, [box_stone(f"A{i % 600}") for i in range(601)])
        assert len(find(session, "entity")) == 7
    assert contents(filled) == before


def test_a_reader_that_fails_half_way_leaves_nothing(filled: Database) -> None:
    def broken() -> Iterator[StoneRecord]:
        yield from (box_stone(f"A{i}") for i in range(700))
        raise SurveyError("point without z", where="new.moma:8000")

    before = contents(filled)
    with pytest.raises(SurveyError, match="8000"), filled.session() as session:
        store_survey(session, "new", "new.moma", OTHER, broken())
    assert contents(filled) == before


def test_a_file_is_taken_in_once(filled: Database) -> None:
    before = contents(filled)
    with pytest.raises(DatabaseError, match=r"copy\.moma: this file is in the database already"):
        store(filled, [box_stone("A1")], "copy")
    assert contents(filled) == before


def test_a_survey_without_stones_is_refused(empty: Database) -> None:
    before = contents(empty)
    with pytest.raises(DatabaseError, match="no stones"), empty.session() as session:
        store_survey(session, "none", "none.moma", SHA, [])
    assert contents(empty) == before


def test_undecodable_file_names_are_spelled_out(empty: Database) -> None:
    with empty.session() as session:
        store_survey(
            session, "a\udcff", "a\udcff.moma", SHA, [replace(box_stone("A"), depth_source="\udc80")]
        )
    with empty.session(read_only=True) as session:
        survey = survey_with_hash(session, SHA)
        assert survey is not None
        assert survey.path == "a\\udcff.moma"
