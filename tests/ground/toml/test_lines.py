"""Lines of the keys of a TOML text, and texts that break its reader."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ground.errors import UsageError
from ground.toml.lines import key_lines, read_text
from pipelines.record.file import parse_record
from pipelines.scene.file import parse_scene


def test_tables_of_an_array_have_their_own_lines():
    text = "[[a]]\nx = 1\n[[a]]\n\nx = 2\n[a.b]\ny = 1\n[[a.c]]\nz = 1\n[[a.c]]\nz = 2\n"
    lines = key_lines(text)
    expected = {
        ("a", "0"): 1,
        ("a", "0", "x"): 2,
        ("a", "1"): 3,
        ("a", "1", "x"): 5,
        ("a", "1", "b", "y"): 7,
        ("a", "1", "c", "0", "z"): 9,
        ("a", "1", "c", "1", "z"): 11,
    }
    assert {path: lines[path] for path in expected} == expected


@given(
    st.dictionaries(
        st.sampled_from(["a", "b-1", "c_2", '"d.e"', "'f'", "g.h"]),
        st.sampled_from(
            ["1", '"# no comment"', "[1,\n 2, # two\n 3]", '"""\n[x]\ny = 1\n"""', "{ p = 1 }", "'='"]
        ),
        max_size=6,
    ),
    st.integers(0, 3),
)
def test_key_lines_agree_with_where_the_keys_were_written(keys, blank):
    lines = ["# head", *[""] * blank, "[table]"]
    written = {}
    for key, value in keys.items():
        written[key] = len("\n".join(lines).split("\n")) + 1
        lines.append(f"{key} = {value} # end")
    text = "\n".join(lines)
    found = key_lines(text)
    assert set(_paths(tomllib.loads(text))) == set(found)
    for key, line in written.items():
        path = tuple(part.strip("\"'") for part in ([key] if key[0] in "\"'" else key.split(".")))
        assert found[("table", *path)] == line


def _paths(tables, above=()):
    """Yield paths of all keys except those inside inline tables, which are on the line of their table."""
    for name, value in tables.items():
        path = (*above, name)
        yield path
        if isinstance(value, dict) and "p" not in value:
            yield from _paths(value, path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[scene]\nname = " + "[" * 3000 + "]" * 3000,
            r"wild\.toml:2: not TOML: lists or tables are nested too",
        ),
        ("[a]\nx = 1\nx = 2\n", r"wild\.toml:3: a\.x is given twice, first in line 2; keep one of them"),
        ("[a]\nx = 1\n[b]\n[a]\n", r"wild\.toml:4: a is given twice, first in line 1; keep"),
        ("[[l]]\nx = 1\n[[l]]\nx = 1\nx = 2\n", r"wild\.toml:5: l\.x is given twice, first in line 4; keep"),
        ("[a]\nx = {y = 1, y = 2}\n", r"wild\.toml:2: a\.x is given twice; keep one"),
        ("[scene]\nx = 1\ny = " + "1" * 5000, r"wild\.toml:3: not TOML: a number has thousands of digits"),
    ],
)
def test_toml_that_breaks_its_reader_is_an_error_with_a_line(text, message):
    for parse in (parse_scene, parse_record):
        with pytest.raises(UsageError, match=message):
            parse(text, "wild.toml")


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("[scene]\nname = 1\n", encoding="utf-8-sig")
    assert read_text(path, UsageError) == "[scene]\nname = 1\n"
    path.write_bytes(b"name = '\xff'")
    with pytest.raises(UsageError, match="byte 8 is not UTF-8"):
        read_text(path, UsageError)
