"""Files of knowledge of any content: recorded, or refused at a line; never a crash, never half of one."""

import datetime as dt
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from archmodel.database.session import open_database
from archmodel.store.stones import store_survey
from ground.errors import MomaError
from ground.toml.schema import REQUIRED, ValueKind
from pipelines.record.keys import ARRAYS
from pipelines.record.record import record
from tests.archmodel.stones import SHA, box_stone

NAMES = (
    *("V1", "V2", "tuff", "2", "WALL", "P1", "header", "voussoir", "star", "crack", "mark", "m", "-"),
    "density",
)
TEXTS = st.sampled_from(
    (*NAMES, "", " ", "\0", "'; drop table entity; --", "%", "course = 1", "kind =", "é\n", "x" * 3000)
)
SCALARS = st.one_of(
    TEXTS,
    st.integers(-(2**70), 2**70),
    st.floats(),
    st.booleans(),
    st.dates(dt.date(1, 1, 1), dt.date(9999, 12, 31)),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(("zone", "rank", "value", *NAMES)), inner, max_size=3)
    ),
    max_leaves=5,
)
INNER = st.dictionaries(
    st.sampled_from(("kind", "zone", "course", "rank", "code", "sign", "density", "slit")),
    SCALARS,
    max_size=2,
)
# what mostly passes the check of types, so that the database is reached
TYPED: dict[ValueKind, st.SearchStrategy[Any]] = {
    ValueKind.TEXT: st.sampled_from(NAMES) | TEXTS.filter(str.strip),
    ValueKind.TEXTS: st.lists(TEXTS.filter(str.strip), max_size=1),
    ValueKind.STONES: st.lists(st.sampled_from(("V1", "V2", "course = 1")), min_size=1, max_size=2),
    ValueKind.NUMBER: st.floats(1e-3, 1e3) | st.floats(0.0),
    ValueKind.INTEGER: st.integers(-1, 3000),
    ValueKind.YEAR: st.one_of(
        st.integers(-1, 3000), st.sampled_from(["circa 1400", "14XX", "1400/..", "late"])
    ),
    ValueKind.BOOLEAN: st.booleans(),
    ValueKind.VECTOR: st.lists(st.floats(allow_nan=False), min_size=3, max_size=3),
    ValueKind.DATE: st.dates(dt.date(1, 1, 1), dt.date(9999, 12, 31)),
    ValueKind.TABLE: INNER | st.dictionaries(st.just("slit"), st.just({"unit": "m", "definition": "x"})),
}
ABOUT: dict[str, st.SearchStrategy[Any]] = {
    "stones": TYPED[ValueKind.STONES],
    "structures": st.just([]),
    "to": st.just(["V2"]),
    "of": st.just(["V1"]),
}


def written(value: Any) -> str:
    """A value as TOML writes it."""
    match value:
        case bool():
            return str(value).lower()
        case dt.date():
            return value.isoformat()
        case float() if value != value:
            return "nan"
        case float():
            return repr(value)
        case list():
            return f"[{', '.join(map(written, value))}]"
        case dict():
            return "{" + ", ".join(f"{json.dumps(key)} = {written(one)}" for key, one in value.items()) + "}"
        case str():
            return json.dumps(value, ensure_ascii=True)
        case _:
            return str(value)


@st.composite
def documents(draw: st.DrawFn) -> str:
    """A few tables, each with keys that it can have, and values that are mostly of their types."""
    lines = []
    for name in draw(st.lists(st.sampled_from(list(ARRAYS)), min_size=1, max_size=4)):
        lines.append(f"[[{name}]]")
        for key in ARRAYS[name]:
            if key.default is REQUIRED or key.name in ABOUT or draw(st.integers(0, 3)) == 0:
                usual = st.sampled_from(key.choices) if key.choices else ABOUT.get(key.name, TYPED[key.kind])
                wild = draw(st.integers(0, 30)) == 0
                lines.append(f"{key.name} = {written(draw(VALUES if wild else usual))}")
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wild")
    with open_database(f"sqlite:///{folder / 'moma.db'}") as database, database.session() as session:
        stones = [box_stone("V1", "voussoir"), box_stone("V2", "voussoir", at=(5.0, 0.0, 0.0))]
        store_survey(session, "window", "window.moma", SHA, stones)
    return folder


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(documents())
def test_any_content_is_recorded_or_refused_at_a_line(place: Path, text: str) -> None:
    path, url = place / "wild.toml", f"sqlite:///{place / 'moma.db'}"
    path.write_text(text, encoding="utf-8")
    where = f"{path}:"
    try:
        record([path], url, dry_run=True)
    except MomaError as error:
        where = error.where or "nowhere"
    assert where.startswith(f"{path}:")
