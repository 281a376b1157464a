"""A damaged file is read correctly or refused with a place: no crash, no hang, no partial result."""

import random
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ground.errors import MomaError, SurveyError
from survey.formats.reading import open_survey, read_survey
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight
from survey.records.survey import BlockRecord, Reject, SolidRecord
from tests.survey.formats.survey_files import EXAMPLES, Example

NUMBERS = [
    *(
        b"nan",
        b"inf",
        b"-inf",
        b"1e999",
        b"-1e999",
        b"1e8",
        b"1.0000001e8",
        b"0x10",
        b"1_000",
        b"1,5",
        b"1.234,5",
    ),
    *("١٢", "１２", "²", "½", "−1", "1\u00a0000"),  # digits and signs of other scripts
    *(b"", b"-", b".", b"e5", b"--1", b"1e", b"+", b"9" * 50, b"1e-400", b"-0", b"0", b"99999999", b"-1"),
]
WORDS = [
    b"stone",
    b"end",
    b"vertex",
    b"sigma",
    b"#",
    b'"',
    b"o",
    b"$Nodes",
    b"solid",
    b"\xff\xfe",
    b"\xe9",
    b"\xc2\x85",
]


def random_number(rng: random.Random) -> bytes:
    one = rng.choice(NUMBERS)
    return one if isinstance(one, bytes) else one.encode()


def flip(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def insert(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    what = rng.choice([b"\0", b"\n", b"\r", b"\r\n", b"\x1a", rng.randbytes(3), *WORDS])
    return data[:at] + what + data[at + rng.randrange(3) :]


def lose(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + data[at + rng.randrange(1, 40) :]


def number(data: bytes, rng: random.Random) -> bytes:
    found = list(re.finditer(rb"[-+]?\d[\d.,]*", data))
    if not found:
        return data
    one = rng.choice(found)
    return data[: one.start()] + random_number(rng) + data[one.end() :]


def lines_of(change: Callable[[list[bytes], int, int], None]) -> Callable[[bytes, random.Random], bytes]:
    def changed(data: bytes, rng: random.Random) -> bytes:
        lines = data.split(b"\n")
        change(lines, rng.randrange(len(lines)), rng.randrange(len(lines)))
        return b"\n".join(lines)

    return changed


def swap(lines: list[bytes], k: int, m: int) -> None:
    lines[k], lines[m] = lines[m], lines[k]


def exchange_fields(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    k = rng.randrange(len(lines))
    parts = re.split(rb"([,;\t ]+)", lines[k])
    i, j = rng.randrange(len(parts)), rng.randrange(len(parts))
    parts[i], parts[j] = parts[j], parts[i]
    lines[k] = b"".join(parts)
    return b"\n".join(lines)


def drop_field(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    k = rng.randrange(len(lines))
    parts = re.split(rb"([,;\t ]+)", lines[k])
    del parts[rng.randrange(len(parts))]
    lines[k] = b"".join(parts)
    return b"\n".join(lines)


def huge_line(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return (
        data[:at] + rng.choice([b" ", b"1", b"x", b'"', b"9 ", b"1,"]) * rng.choice([500, 70_000]) + data[at:]
    )


CHANGES: list[Callable[[bytes, random.Random], bytes]] = [
    *(flip, flip, cut, insert, insert, lose, number, number, number, exchange_fields, drop_field, huge_line),
    lines_of(swap),
    lines_of(lambda lines, k, m: lines.insert(m, lines[k])),
    lines_of(lambda lines, k, m: lines.__delitem__(k)),
    lines_of(lambda lines, k, m: lines.__setitem__(k, lines[m])),
]


def mutated(example: Example, seed: int) -> bytes:
    rng, data = random.Random(seed), example.data
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        if data:
            data = rng.choice(CHANGES)(data, rng)
    return data


def read_or_locate(path: Path, format: str, data: bytes) -> bool:
    """Read a file; return whether all of it was accepted."""
    path.write_bytes(data)
    whole, stones = True, 0
    try:
        for one in open_survey(path, format).blocks:
            stones += 1
            if isinstance(one, Reject):
                check_place(one.error, path)
                assert all(1 <= span.start < span.stop for span in one.spans)
                whole = False
            elif isinstance(one, BlockRecord):
                check_block(one, data, format)
            else:
                check_solid(one)
    except SurveyError as error:
        check_place(error, path)
        whole = False
    else:
        assert stones
    return whole


def check_place(error: MomaError, path: Path) -> None:
    place = str(error.where)
    assert place == str(path) or re.fullmatch(re.escape(str(path)) + r":[1-9]\d*", place), place
    assert error.remedy
    assert "\n" not in str(error)
    assert len(str(error)) < 600


def check_block(one: BlockRecord, data: bytes, format: str) -> None:
    """Check that a block is sound, and that none of its lines was left out."""
    measured = np.vstack([one.points, one.vertices])
    assert np.isfinite(measured).all()
    assert np.abs(measured).max(initial=0.0) <= 1e8
    assert len(one.vertices) >= 3 or (one.photograph is not None and len(one.image) >= 3)
    assert one.sigma > 0.0
    if format == "geojson" or data.startswith((b"PK", b"\xff\xfe", b"\xfe\xff")) or b"POLYGON" in data:
        return  # of which a line is not a point
    if b"\r" in data and (b"\n" not in data or data.startswith(b"<?xml")):  # each ends a line of XML
        data = data.replace(b"\r\n", b"\n")
        data = data.replace(b"\r", b"\n")
    lines = ["", *data.decode("utf-8-sig" if is_utf8(data) else "cp1252", "replace").split("\n")]
    own = [lines[k] for span in one.spans for k in span]
    if format == "moma":
        counted = sum(bool(re.match(r"\s*(vertex|point|pixel)(\s|$)", line)) for line in own)
        assert counted == len(measured) + len(one.image)
        np.testing.assert_array_equal(
            measured, [*naive(own, "point"), *naive(own, "vertex")] or np.empty((0, 3))
        )
    else:
        assert len(own) == len(measured) or any('"' in line for line in own)
        assert all(one.notes.get("name", one.code) in line for line in own) or any(
            '"' in line for line in own
        )
        assert one.names == () or len(one.names) == len(measured)


def naive(lines: list[str], word: str) -> list[list[float]]:
    """Read the coordinates of a native stone without any check."""
    rows = [line.split() for line in lines]
    return [[float(text) for text in row[1:4]] for row in rows if row and row[0] == word]


def is_utf8(data: bytes) -> bool:
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def check_solid(one: SolidRecord) -> None:
    check_watertight(Solid(one.code, one.vertices, one.faces))


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_are_valid(tmp_path: Path, name: str) -> None:
    example = EXAMPLES[name]
    path = tmp_path / f"m.{example.ending}"
    assert read_or_locate(path, example.format, example.data)
    assert tuple(one.code for one in open_survey(path, example.format).blocks) == example.codes


@settings(max_examples=600, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(list(EXAMPLES)), st.integers(0, 2**63))
def test_mutated_files_are_read_or_refused_with_a_place(tmp_path: Path, name: str, seed: int) -> None:
    example = EXAMPLES[name]
    read_or_locate(tmp_path / f"m.{example.ending}", example.format, mutated(example, seed))


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([(one.format, one.ending) for one in EXAMPLES.values()]),
    st.binary(max_size=200) | st.text(max_size=100).map(lambda text: text.encode("utf-8", "replace")),
    st.sampled_from([b"", b"moma-survey 1\n", b"ply\n", b"solid \n", b"$MeshFormat\n4.1 0 8\n", b"block,"]),
)
def test_any_bytes_are_read_or_refused_with_a_place(
    tmp_path: Path, kind: tuple[str, str], data: bytes, start: bytes
) -> None:
    read_or_locate(tmp_path / f"m.{kind[1]}", kind[0], start + data)


@pytest.mark.parametrize("name", [name for name, one in EXAMPLES.items() if one.format != "solids"])
def test_what_is_refused_in_part_is_refused_as_a_whole(tmp_path: Path, name: str) -> None:
    example = EXAMPLES[name]
    path = tmp_path / f"m.{example.ending}"
    for seed in range(40):
        data = mutated(example, seed)
        if read_or_locate(path, example.format, data):
            assert read_survey(path, example.format).blocks
        else:
            with pytest.raises(SurveyError):
                read_survey(path, example.format)


@pytest.mark.slow
def test_ten_thousand_mutated_files_are_read_or_refused_with_a_place(tmp_path: Path) -> None:
    accepted = 0
    for number in range(10_000):
        example = list(EXAMPLES.values())[number % len(EXAMPLES)]
        data = mutated(example, 1_000_000 + number)
        accepted += read_or_locate(tmp_path / f"m.{example.ending}", example.format, data)
    assert 500 < accepted < 9_500  # the mutations neither miss nor drown what they test
