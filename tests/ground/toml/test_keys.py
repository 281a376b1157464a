"""Keys of a scene file derived from settings dataclasses."""

from dataclasses import dataclass, field
from datetime import date
from enum import StrEnum
from typing import Annotated

import pytest

from ground.errors import SceneError
from ground.settings import Setting
from ground.toml.keys import Stones, Table, Texts, Year, build, keys_of, read_table
from ground.toml.schema import REQUIRED, TomlDocument, ValueKind, check_table, tables_of
from mechanics.stones.settings import check_settings


class Colour(StrEnum):
    RED = "red"
    GREEN = "green"


@dataclass(frozen=True)
class Paint:
    weight: Annotated[float, Setting("Weight.", "kg", above=0, at_most=5)]
    coats: Annotated[int, Setting("Coats.", choices=(1, 3))] = 3
    colour: Annotated[Colour, Setting("Colour.")] = Colour.RED
    second: Annotated[Colour | None, Setting("Second colour.")] = None
    names: Annotated[tuple[str, ...], Setting("Names.")] = ()
    own: int = 7


def test_fields_with_a_declaration_become_keys():
    keys = {key.name: key for key in keys_of(Paint, "names")}
    assert list(keys) == ["weight", "coats", "colour", "second", "names"]
    weight = keys["weight"]
    assert (weight.kind, weight.doc, weight.unit) == (ValueKind.NUMBER, "Weight.", "kg")
    assert (weight.default, weight.above, weight.at_most) == (REQUIRED, 0, 5)
    assert (keys["coats"].default, keys["coats"].choices) == (3, (1, 3))
    assert (keys["colour"].default, keys["colour"].choices) == ("red", ("red", "green"))
    assert (keys["second"].kind, keys["second"].default) == (ValueKind.TEXT, None)
    assert keys["names"].default is REQUIRED


def test_a_checked_table_makes_the_dataclass():
    given = {"weight": 2, "colour": "green", "names": ["a"]}
    values = check_table(TomlDocument("paint.toml"), ("paint",), given, keys_of(Paint))
    assert build(Paint, values | {"other": 1}) == Paint(2.0, 3, Colour.GREEN, None, ("a",))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"weight": 0.0}, "paint: weight = 0.0; give a number greater than 0 and of at most 5 [kg]"),
        ({"weight": 5.1}, "weight = 5.1"),
        ({"weight": float("nan")}, "weight = nan"),
        ({"coats": 2}, "coats = 2; give 1 or 3"),
    ],
)
def test_the_dataclass_is_held_to_the_same_bounds(changed, message):
    with pytest.raises(SceneError) as caught:
        check_settings("paint", Paint(**{"weight": 1.0} | changed))
    assert message in str(caught.value)


@dataclass(frozen=True, kw_only=True)
class Repair:
    """Table whose values are read otherwise than their types say."""

    stones: Annotated[Stones, Setting("Codes of the stones.")]
    begun: Annotated[Year | None, Setting("Year.")] = None
    done: Annotated[date | None, Setting("Day.")] = None
    by: Annotated[Texts, Setting("Masons.")] = ()
    state: Annotated[str, Setting("State.", choices=("good", "poor"))] = "good"
    costs: Annotated[Table, Setting("By position.")] = field(default_factory=dict)


def test_a_kind_beside_a_type_says_how_a_value_is_read():
    assert [key.kind for key in keys_of(Repair)] == [
        *(ValueKind.STONES, ValueKind.YEAR, ValueKind.DATE),
        *(ValueKind.TEXTS, ValueKind.TEXT, ValueKind.TABLE),
    ]
    given = {"stones": ["A1"], "begun": "circa 1400", "done": date(1410, 5, 1), "costs": {"lime": 3}}
    read = read_table(TomlDocument("r.toml"), ("repair",), given, Repair)
    assert read == Repair(stones=("A1",), begun="circa 1400", done=date(1410, 5, 1), costs={"lime": 3})
    wrong = {
        "'stones' = []": {"stones": []},
        "state = 'pour' is unknown": {"stones": ["A1"], "state": "pour"},
        "did you mean 'begun'": {"stones": ["A1"], "begn": 1400},
        "'stones'; give stones: a list of codes": {},
    }
    for said, table in wrong.items():
        with pytest.raises(SceneError, match=said.replace("'stones' = []", "stones = ")):
            read_table(TomlDocument("r.toml"), ("repair",), table, Repair)


def test_tables_of_an_array_have_their_places():
    document, inner = TomlDocument("r.toml"), {"repair": [{"by": []}, {"costs": 1}]}
    assert tables_of(document, inner, "repair") == [
        (("repair", "0"), {"by": []}),
        (("repair", "1"), {"costs": 1}),
    ]
    assert tables_of(document, {}, "repair") == []
    for given in ({"repair": {}}, {"repair": [1]}, {"repair": "none"}):
        with pytest.raises(
            SceneError, match=r"'repair' is not a list of tables; write \[\[phase.repair\]\] above each"
        ):
            tables_of(document, given, "repair", ("phase", "3"))
