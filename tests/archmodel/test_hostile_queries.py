"""Whatever is written in --where gives stones or a QueryError, soon, and changes nothing."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from archmodel.attributes import ATTRIBUTES
from archmodel.database import Database, open_database
from archmodel.query import find, find_rows
from archmodel.store import store_survey
from archmodel.store_runs import store_run
from moma.errors import QueryError
from tests.archmodel.conftest import WALL
from tests.archmodel.stones import SHA, box_stone, contents, run_record

pytestmark = pytest.mark.filterwarnings("error")


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    folder: Path = tmp_path_factory.mktemp("hostile")
    with open_database(f"sqlite:///{folder / 'moma.db'}") as database:
        with database.session() as session:
            store_survey(session, "window", "window.moma", SHA, WALL)
            store_run(session, run_record({"V1": 3e5, "V2": None}))
        yield database


@pytest.fixture(scope="module", autouse=True)
def unchanged(database: Database) -> Iterator[None]:
    """Nothing in this module may change the database, though its sessions could write."""
    before = contents(database)
    yield
    assert contents(database) == before


def ask(database: Database, expression: str) -> list[str] | None:
    """Codes that were found; None if the expression was refused."""
    refusal: QueryError | None = None
    try:
        with database.session() as session:
            return [entity.code for entity in find(session, "entity", [expression])]
    except QueryError as error:
        refusal = error
    assert str(refusal).isprintable()
    assert len(str(refusal)) < 600
    return None


PIECES = [
    *ATTRIBUTES,
    *["and", "or", "not", "in", "like", "is", "null", "(", ")", ",", "=", "==", "!=", "<", "<=", ">", ">="],
    *[
        "0.4",
        "-1",
        "2e5",
        "1e999",
        "nan",
        "inf",
        "0x10",
        "1_0",
        "٣",
        "'",
        '"',
        "''",
        "'V1'",
        "V1",
        "%",
        "_",
        "\\",
    ],
    *[
        ";",
        "--",
        "/*",
        "*/",
        "DROP TABLE entity",
        "UNION SELECT",
        ":kind_1",
        "?",
        "?1",
        "@x",
        "$x",
        "[x]",
        "`x`",
    ],
    *[
        "\0",
        "\n",
        "\u2028",
        "\ud800",
        "\U0010ffff",
        "́",
        "\u202e",
        "🧱",
        "ſ",
        "İ",
        "ǅ",
        "entity.id",
        "1=1",
        "{}",
        "%s",
    ],
]
pieces = st.sampled_from(PIECES)
written = st.one_of(
    st.text(max_size=60),
    st.text(st.characters(), max_size=60),
    st.lists(pieces, max_size=25).map(" ".join),
    st.lists(pieces, max_size=25).map("".join),
    st.lists(st.one_of(pieces, st.text(max_size=8)), max_size=15).map(" ".join),
)


@settings(max_examples=1000, deadline=None)
@given(written)
@example("code = 'V1'; DROP TABLE entity; --'")
@example("code = 'V1' OR 1=1")
@example("code = '\ud800'")
@example("İ = 1")
def test_anything_gives_stones_or_a_query_error(database: Database, expression: str) -> None:
    ask(database, expression)


INJECTIONS = [
    "'; DROP TABLE entity; --",
    "' OR '1'='1",
    '" OR ""="',
    "x'; DELETE FROM run; SELECT '",
    "V1' UNION SELECT * FROM run --",
    "?",
    ":code_1",
    "%(code)s",
    "{0}",
    "V1\\' OR 1=1 --",
    "/**/",
    "V1;",
    "char(0)",
    "(SELECT code FROM entity)",
]


@pytest.mark.parametrize("value", INJECTIONS)
@pytest.mark.parametrize(
    "shape", ["code = {}", "code like {}", "code in ({}, {})", "not code != {}", "survey = {}"]
)
def test_an_injected_statement_is_only_a_text_that_no_stone_has(
    database: Database, value: str, shape: str
) -> None:
    quoted = "'" + value.replace("'", "''") + "'"
    assert ask(database, shape.replace("{}", quoted)) == []


@pytest.mark.parametrize("value", INJECTIONS)
def test_an_injected_statement_outside_quotes_finds_nothing_or_is_refused(
    database: Database, value: str
) -> None:
    for shape in ("code = {}", "code = '{}'", "{}", "{} = 1", "depth > {}", "depth > 0 and {}", "kind = {}"):
        assert ask(database, shape.replace("{}", value)) in (None, [])


def test_a_code_with_every_quote_in_it_is_found_by_its_quoted_text(empty: Database) -> None:
    code = """W'1"';DROP--%_\\"""
    with empty.session() as session:
        store_survey(session, "odd", "odd.moma", SHA, [box_stone(code), box_stone("W2")])
    assert ask(empty, "code = '" + code.replace("'", "''") + "'") == [code]
    assert ask(empty, 'code = "' + code.replace('"', '""') + '"') == [code]


LONG: list[tuple[str, str]] = [
    ("one megabyte", "a" * 1_000_000),
    ("a megabyte of parentheses", "(" * 1_000_000),
    ("a megabyte of nots", "not " * 250_000),
    ("a megabyte of quotes", "'" * 1_000_000),
    ("a megabyte of tests", "depth > 1 and " * 70_000 + "depth > 1"),
    ("just too long", "depth > 1" + " " * 1992),
    ("deep parentheses", "(" * 900 + "depth > 1" + ")" * 900),
    ("deep nots", "not " * 400 + "depth > 1"),
    ("deep mixed", "not (" * 300 + "depth > 1" + ")" * 300),
    ("one level too deep", "(" * 31 + "depth > 1" + ")" * 31),
    ("unclosed quotes", "code = '" + "''" * 900),
    ("a long unknown name", "d" * 1990 + " = 1"),
    ("a long unknown kind", "kind = " + "v" * 1990),
    ("digits", "depth > " + "9" * 1900),
]


@pytest.mark.parametrize(("name", "expression"), LONG, ids=[name for name, _ in LONG])
def test_long_and_deep_expressions_are_refused_at_once(
    database: Database, name: str, expression: str
) -> None:
    start = time.perf_counter()
    assert ask(database, expression) is None
    assert time.perf_counter() - start < 0.5


BIG: list[tuple[str, str]] = [
    ("the deepest parentheses", "(" * 30 + "depth > 0" + ")" * 30),
    ("the most nots", "not " * 30 + "depth > 0"),
    ("a long conjunction", " and ".join(["x>-9"] * 200)),
    ("a long disjunction", " or ".join(["x>-9"] * 220)),
    ("a long list", "not code in (" + ",".join(["a"] * 990) + ")"),
    ("a tiny number", "depth > 1e-9999"),
    ("a number with many digits", "depth > 0." + "0" * 1900 + "1"),
]


@pytest.mark.parametrize(("name", "expression"), BIG, ids=[name for name, _ in BIG])
def test_expressions_at_the_limits_are_answered(database: Database, name: str, expression: str) -> None:
    assert len(expression) <= 2000
    start = time.perf_counter()
    assert ask(database, expression) == [stone.code for stone in WALL]
    assert time.perf_counter() - start < 2.0


def test_a_pattern_of_wildcards_does_not_hang(empty: Database) -> None:
    with empty.session() as session:
        store_survey(session, "long", "long.moma", SHA, [box_stone("a" * 300)])
    start = time.perf_counter()
    assert ask(empty, "code like '" + "%a" * 250 + "%b'") == []
    assert ask(empty, "code like '" + "%a_" * 90 + "%b'") == []
    assert time.perf_counter() - start < 5.0


def test_many_expressions_are_refused(database: Database) -> None:
    with database.session() as session:
        assert len(find(session, "entity", ["depth > 0"] * 20)) == len(WALL)
        with pytest.raises(QueryError, match="21 expressions, at most 20"):
            find(session, "entity", ["depth > 0"] * 21)
        # The limits together: as many parameters as can be written.
        crowd = "not code in (" + ",".join(["a"] * 993) + ")"
        assert len(find(session, "entity", [crowd] * 20)) == len(WALL)


# Against a slow and simple reference: each generated expression carries its meaning, in three-valued logic.

Row = dict[str, object]
Meaning = Callable[[Row], bool | None]
Sentence = tuple[str, Meaning]

COMPARE: dict[str, Callable[[float, float], bool]] = {
    "=": lambda a, b: a == b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}
NUMBERS = sorted(name for name, attribute in ATTRIBUTES.items() if attribute.is_number)


def compared(name: str, sign: str, other: float | str) -> Sentence:
    def meaning(row: Row) -> bool | None:
        left, right = row[name], row[other] if isinstance(other, str) else other
        if left is None or right is None:
            return None
        return COMPARE[sign](left, right)  # type: ignore[arg-type]

    return f"{name} {sign} {other}", meaning


def member(name: str, values: list[float], negated: bool) -> Sentence:
    text = f"{name} {'not ' if negated else ''}in ({', '.join(map(str, values))})"
    return text, lambda row: None if row[name] is None else (row[name] in values) is not negated


def coded(codes: list[str]) -> Sentence:
    return f"code in ({', '.join(codes)})", lambda row: row["code"] in codes


def known(name: str, negated: bool) -> Sentence:
    return f"{name} is {'not ' if negated else ''}null", lambda row: (row[name] is None) is not negated


def denied(inner: Sentence) -> Sentence:
    def meaning(row: Row) -> bool | None:
        value = inner[1](row)
        return None if value is None else not value

    return f"not ({inner[0]})", meaning


def joined(parts: list[Sentence], word: str) -> Sentence:
    decisive = word == "or"  # one true decides an or, one false decides an and

    def meaning(row: Row) -> bool | None:
        values = [part[1](row) for part in parts]
        if decisive in values:
            return decisive
        return None if None in values else not decisive

    return f" {word} ".join(f"({part[0]})" for part in parts), meaning


numbers = st.one_of(
    st.sampled_from([0.2, 0.3, 0.42, 0.45, 1.0, 2.0, 9.0, 3e5, 6.0]),
    st.floats(-1e6, 1e6),
    st.integers(-3, 10),
)
names = st.sampled_from(NUMBERS)
tests = st.one_of(
    st.builds(compared, names, st.sampled_from(sorted(COMPARE)), st.one_of(numbers, names)),
    st.builds(member, names, st.lists(numbers, min_size=1, max_size=4), st.booleans()),
    st.builds(coded, st.lists(st.sampled_from([stone.code for stone in WALL]), min_size=1, max_size=4)),
    st.builds(known, st.sampled_from(sorted(ATTRIBUTES)), st.booleans()),
)
sentences = st.recursive(
    tests,
    lambda inner: st.one_of(
        inner.map(denied),
        st.builds(joined, st.lists(inner, min_size=2, max_size=3), st.sampled_from(["and", "or"])),
    ),
    max_leaves=8,
)


@settings(max_examples=500, deadline=None)
@given(sentences)
def test_an_expression_finds_what_it_means(database: Database, sentence: Sentence) -> None:
    text, meaning = sentence
    with database.session(read_only=True) as session:
        rows = find_rows(session, "entity")
        assert [e.code for e in find(session, "entity", [text])] == [r["code"] for r in rows if meaning(r)]
