from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from ground.errors import SurveyError
from ground.tables.text_lines import TextLines


def lines(path: Path, data: bytes) -> tuple[list[str], str, int]:
    path.write_bytes(data)
    text = TextLines(path)
    found = list(text)
    assert [number for number, _ in found] == list(range(1, len(found) + 1))
    return [line for _, line in found], text.encoding, text.end


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_text_is_read_in_the_encoding_it_is_in(tmp_path: Path, encoding: str, end: str) -> None:
    text = ["façade sud, tour Ségur", "", "  30° ± ½ µm", "last"]
    found, name, last = lines(tmp_path / "a.txt", end.join(text).encode(encoding))
    assert (found, name, last) == (text, {"latin-1": "cp1252"}.get(encoding, "utf-8"), 4)
    assert lines(tmp_path / "a.txt", (end.join(text) + end).encode(encoding))[2] == 5


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_wide_characters_and_old_line_ends_are_read(tmp_path: Path, encoding: str, end: str) -> None:
    """As Excel writes "Unicode text", and as old Macintoshes end lines."""
    text = end.join(["façade sud", "σ ≤ 3 mm", ""])
    mark = "" if encoding == "utf-16" else "\ufeff"
    assert lines(tmp_path / "a.txt", (mark + text).encode(encoding)) == (
        ["façade sud", "σ ≤ 3 mm"],
        "utf-8",
        3,
    )
    assert lines(tmp_path / "a.txt", text.encode()) == (["façade sud", "σ ≤ 3 mm"], "utf-8", 3)


def test_quotation_marks_of_windows_are_read(tmp_path: Path) -> None:
    text = "“gate” – façade, 12 €"
    assert lines(tmp_path / "a.txt", text.encode("cp1252"))[:2] == ([text], "cp1252")


def test_signs_that_latin_1_has_not_are_read_from_utf_8(tmp_path: Path) -> None:
    assert lines(tmp_path / "a.txt", "σ ≤ 3 mm, “gate”\n".encode())[:2] == (["σ ≤ 3 mm, “gate”"], "utf-8")


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=9), max_size=9),
    st.integers(1, 40),
)
@example(["a\u2028b\u0085c".replace("\u0085", ""), "\ufeff"], 3)
def test_lines_end_where_line_feeds_are(tmp_path: Path, text: list[str], repeat: int) -> None:
    """Python's own splitting at line feeds, in one piece; other separators of Unicode are text."""
    whole = "\n".join(["x", *text * repeat])
    found, encoding, end = lines(tmp_path / "a.txt", whole.encode())
    assert encoding == "utf-8"
    assert found == (whole.split("\n") if not whole.endswith("\n") else whole.split("\n")[:-1])
    assert end == whole.count("\n") + 1


def test_a_file_longer_than_a_block_is_read_line_by_line(tmp_path: Path) -> None:
    text = [f"{k} é " + "x" * (k % 977) for k in range(3000)]
    data = "\r\n".join(text).encode()
    assert len(data) > 5 * (1 << 18)
    assert lines(tmp_path / "a.txt", data) == (text, "utf-8", 3000)
    assert lines(tmp_path / "a.txt", data.decode().encode("latin-1")) == (text, "cp1252", 3000)


@pytest.mark.parametrize(
    ("data", "line", "words"),
    [
        (b"\xff\xfea\0b", 1, "mark of UTF-16, but is not"),
        ("a\nb".encode("utf-32"), 1, "UTF-32"),
        (b"PK\x03\x04...", 1, "a workbook"),
        (b"%PDF-1.7", 1, "a PDF"),
        ("a\nb".encode("utf-16-le"), 1, "0x00"),
        (b"a\nb\0c", 2, "0x00"),
        (b"a\rb\nc", 1, "0x0d"),
        (b"a\n\x1a", 2, "0x1a"),
        (b"a\n\x7f", 2, "0x7f"),
        ("a\nb\u0085".encode(), 2, "0x85"),
        (b"\xe9\n\x93gate\x9d", 2, "0x9d"),  # which is nothing in Windows either
        (b"\xef\xbb\xbfa\n\xe9\n", 2, "byte 0xe9 is not UTF-8"),
        (b"a\n" * 200_000 + b"b\x01\n", 200_001, "0x01"),
        (b"a\n" * 200_000 + b"b" * 70_000, 200_001, "more than 65536 bytes"),
        (b"a\n" + b"b" * 70_000 + b"\nc\n", 2, "more than 65536 bytes"),
        (b"b" * 1_000_000, 1, "more than 65536 bytes"),
    ],
)
def test_what_is_no_text_is_refused_with_its_line(tmp_path: Path, data: bytes, line: int, words: str) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(data)
    with pytest.raises(SurveyError) as error:
        TextLines(path)
    assert f"a.txt:{line}: " in str(error.value)
    assert words in str(error.value)
    assert error.value.remedy


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"none: cannot be read: No such file"):
        TextLines(tmp_path / "none")
    with pytest.raises(SurveyError, match="cannot be read"):
        TextLines(tmp_path)
    with pytest.raises(SurveyError, match="cannot be read"):
        TextLines(Path("a\0b"))
    assert lines(tmp_path / "a.txt", b"") == ([], "utf-8", 1)
