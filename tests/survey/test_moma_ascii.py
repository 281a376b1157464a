import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from moma.errors import SurveyError
from survey.formats.moma_ascii import read_moma, write_moma
from survey.records import Survey

SAMPLE = (Path(__file__).parents[2] / "data" / "samples" / "window" / "window.moma").read_bytes()
STONE = "stone A header course 2\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nend\n"
HEAD = "moma-survey 1\nsigma 0.003\n"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "a.moma"
    path.write_text(text, encoding="utf-8")
    return path


def assert_same(one: Survey, other: Survey) -> None:
    assert (one.head.name, one.head.depth_rules) == (other.head.name, other.head.depth_rules)
    for a, b in zip(one.blocks, other.blocks, strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)
        np.testing.assert_array_equal(a.points, b.points)
        for name in (
            "code",
            "kind",
            "course",
            "sigma",
            "depth",
            "depth_sigma",
            "depth_source",
            "notes",
            "line",
        ):
            assert getattr(a, name) == getattr(b, name), name


def test_all_that_a_stone_can_say_is_read(tmp_path: Path) -> None:
    text = (
        "# a wall\nmoma-survey 1\nname north wall\nobserver 1 -2e1 +3.5 # tripod\nsigma 0.003\n"
        "depth header 0.5 sigma 0.02 source broken end at W03 # sic\n\n"
        "stone W01-01 header course 1\n\tsigma 0.005\n  depth 0.61 source drilled\n  note mason a cross\n"
        "  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 1 0\n  point .5 .5 0.001\nend\n"
        "stone V1 voussoir\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nend\n"
    )
    survey = read_moma(write(tmp_path, text))
    assert survey.head.name == "north wall"
    assert survey.head.viewpoint(None) is not None
    assert survey.head.viewpoint(None).tolist() == [1.0, -20.0, 3.5]
    (rule,) = survey.head.depth_rules
    assert (rule.kind, rule.depth, rule.sigma, rule.source, rule.line) == (
        *("header", 0.5, 0.02),
        "broken end at W03 # sic",
        6,
    )
    first, second = survey.blocks
    assert (first.code, first.kind, first.course, first.sigma, first.line) == (
        "W01-01",
        "header",
        1,
        0.005,
        8,
    )
    assert (first.depth, first.depth_sigma, first.depth_source) == (0.61, None, "drilled")
    assert first.notes == {"mason": "a cross"}
    assert first.vertices.shape == (3, 3)
    assert first.points.tolist() == [[0.5, 0.5, 0.001]]
    assert (second.course, second.sigma, second.points.shape) == (None, 0.003, (0, 3))


def test_what_is_written_is_read_back_to_the_last_bit(tmp_path: Path, survey: Survey) -> None:
    again = tmp_path / "again.moma"
    write_moma(survey, again)
    assert again.read_bytes() == SAMPLE
    assert_same(read_moma(again), survey)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "empty"),
        ("stone A header\n", 1, "not a MOMA survey"),
        ("moma-survey 2\n", 1, "moma-survey 1"),
        (HEAD, 3, "no stones"),
        (HEAD + "ston A header\n", 3, "'ston'"),
        (HEAD + "stone A header 3\n", 3, "stone CODE KIND"),
        (HEAD + "stone A Header\n", 3, "kind"),
        (HEAD + "stone A header course one\n", 3, "course"),
        (HEAD + STONE + STONE, 8, "line 3"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1"), 6, "2 coordinates"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 nan"), 6, "'nan'"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 1_0"), 6, "'1_0'"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 1e999"), 6, "1e999"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 0,5"), 6, "'0,5'"),
        (HEAD + STONE.replace("vertex 1 1 0\n", ""), 6, "2 vertices"),
        (HEAD + STONE.replace("end\n", ""), 7, "no 'end'"),
        (HEAD + STONE.replace("end", "depth 0.5 source x\ndepth 0.4 source y\nend"), 8, "second 'depth'"),
        (HEAD + STONE.replace("end", "depth 0.5\nend"), 7, "source"),
        (HEAD + STONE.replace("end", "depth -0.5 source x\nend"), 7, "greater than 0"),
        (HEAD + "depth header 0.5 source x\ndepth header 0.4 source y\n", 4, "line 3"),
        ("moma-survey 1\n" + STONE, 6, "sigma"),
        (HEAD + STONE + "sigma 0.01\n", 8, "unknown word"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, text: str, line: int, words: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_moma(write(tmp_path, text))
    assert f"a.moma:{line}: " in str(error.value)
    assert words in str(error.value)
    assert error.value.remedy
    assert "\n" not in str(error.value)


def test_a_missing_file_and_other_encodings_are_named(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"none\.moma: cannot be read"):
        read_moma(tmp_path / "none.moma")
    with pytest.raises(SurveyError, match="cannot be read"):
        read_moma(tmp_path)
    path = tmp_path / "wide.moma"
    path.write_text(HEAD + STONE, encoding="utf-16")
    with pytest.raises(SurveyError, match=r"wide\.moma:1: the text is UTF-16"):
        read_moma(path)


def read_or_locate(path: Path) -> None:
    """The only two outcomes a file may have."""
    try:
        survey = read_moma(path)
    except SurveyError as error:
        where = str(error.where)
        located = where.startswith(f"{path}:") and int(where.rpartition(":")[2]) >= 1
        assert located, where
    else:
        assert survey.blocks
        assert all(np.isfinite(b.vertices).all() and len(b.vertices) >= 3 for b in survey.blocks)


MUTATIONS = st.lists(
    st.tuples(
        st.sampled_from(["swap", "cut", "double", "byte", "line", "number"]),
        st.integers(0, 2**31),
        st.binary(max_size=6),
    ),
    min_size=1,
    max_size=4,
)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(MUTATIONS)
def test_mutated_files_are_read_or_refused_with_their_line(
    tmp_path: Path, changes: list[tuple[str, int, bytes]]
) -> None:
    data = SAMPLE[:6000]
    data = data[: data.rindex(b"end\n") + 4]
    for how, seed, extra in changes:
        data = mutate(data, how, random.Random(seed), extra)
    path = tmp_path / "m.moma"
    path.write_bytes(data)
    read_or_locate(path)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=200)
    | st.text(max_size=100).map(lambda t: f"moma-survey 1\n{t}".encode("utf-8", "replace"))
)
def test_any_bytes_are_read_or_refused_with_their_line(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "m.moma"
    path.write_bytes(data)
    read_or_locate(path)


def mutate(data: bytes, how: str, rng: random.Random, extra: bytes) -> bytes:
    lines = data.split(b"\n")
    at, k, m = rng.randrange(len(data) + 1), rng.randrange(len(lines)), rng.randrange(len(lines))
    if how == "cut":
        return data[:at]
    if how == "byte":
        return data[:at] + extra + data[at + rng.randrange(3) :]
    if how == "swap":
        lines[k], lines[m] = lines[m], lines[k]
    elif how == "double":
        lines.insert(m, lines[k])
    elif how == "line":
        del lines[k]
    else:
        words = lines[k].split(b" ")
        words[rng.randrange(len(words))] = rng.choice(
            [b"1e400", b"-0", b"nan", b"", b"\xff", b"1e8", b"9" * 50, extra]
        )
        lines[k] = b" ".join(words)
    return b"\n".join(lines)


def test_a_note_of_two_lines_cannot_be_written(tmp_path: Path, survey: Survey) -> None:
    two = replace(survey, head=replace(survey.head, name="north\nsigma 9"))
    with pytest.raises(SurveyError, match=r"cannot be written"):
        write_moma(two, tmp_path / "two.moma")
    assert not (tmp_path / "two.moma").exists()
