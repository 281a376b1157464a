"""Values are the same wherever the text is cut into pieces, and mistakes are at their line and character."""

import io
import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from archmodel.exchange import json_stream as exchange_text
from archmodel.exchange.json_stream import JsonText
from ground.errors import ExchangeError

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda items: st.lists(items, max_size=4) | st.dictionaries(st.text(max_size=5), items, max_size=4),
    max_leaves=12,
)


class Dripping(io.RawIOBase):
    """Bytes that come a few at a time."""

    def __init__(self, raw: bytes, size: int) -> None:
        self._raw, self._size = io.BytesIO(raw), size

    def read(self, size: int = -1) -> bytes:
        return self._raw.read(self._size)


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(values=st.lists(VALUES, min_size=1, max_size=5), size=st.integers(1, 7), escaped=st.booleans())
def test_a_value_is_whole_however_few_bytes_come_at_a_time(values: list[Any], size: int, escaped: bool):
    raw = " , \n".join(json.dumps(value, ensure_ascii=escaped, indent=1) for value in values)
    text = JsonText(Dripping(raw.encode("utf-8", "replace"), size), "t")  # type: ignore[arg-type]
    found = [text.value()]
    while text.take(",", "") == ",":
        found.append(text.value())
    assert repr(found) == repr(json.loads(f"[{raw}]".encode("utf-8", "replace")))


@settings(max_examples=50, deadline=None)
@given(lines=st.lists(st.text("a é", max_size=20), max_size=5), size=st.integers(1, 5))
def test_a_mistake_is_at_its_line_and_character(lines: list[str], size: int):
    strings = ",\n".join(json.dumps(line, ensure_ascii=False) for line in ["", *lines])
    text = JsonText(Dripping(f"[{strings}]  wrong".encode(), size), "t")  # type: ignore[arg-type]
    assert text.value() == ["", *lines]
    last = strings.split("\n")[-1]
    character = len(last) + (1 if lines else 2) + 1 + 2
    with pytest.raises(ExchangeError, match=rf"t:{len(lines) + 1} character {character}: this is no JSON"):
        text.value()


def test_a_number_that_goes_on_in_the_next_piece_is_one_number():
    text = JsonText(Dripping(b"12345 ", 2), "t")  # type: ignore[arg-type]
    assert text.value() == 12345


def test_a_value_without_end_is_not_read_for_ever():
    class Endless(io.RawIOBase):
        """A text that begins and never ends."""

        given = 0

        def read(self, size: int = -1) -> bytes:
            begin = b"x" if self.given else b'"'
            self.given += size
            return begin + b"x" * (size - 1)

    stream = Endless()
    text = JsonText(stream, "t", limit=5_000_000)  # type: ignore[arg-type]
    with pytest.raises(ExchangeError, match=r"t:1 character 1: a value is longer than 5000000 characters"):
        text.value()
    assert stream.given < 20_000_000


def test_blanks_without_end_take_no_memory():
    text = JsonText(Dripping(b" " * 50_000_000 + b"1", exchange_text.CHUNK), "t")  # type: ignore[arg-type]
    assert text.value() == 1


def test_a_mark_of_the_byte_order_is_no_part_of_the_document():
    assert JsonText(io.BytesIO(b"\xef\xbb\xbf[1]"), "t").value() == [1]
