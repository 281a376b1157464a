"""Advice that an error prints works when it is copied; every option and command that a message names exists."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer

from moma.cli import app
from tests.moma.commands import invoke
from tests.paths import ROOT

PACKAGES = ("ground", "moma", "survey", "archmodel", "mechanics", "pipelines")
PROGRAMS = {"pipelines/reports/page/paper.py", "pipelines/assess/workers/cluster.py", "ground/errors.py"}
"""Modules that name options of Chromium, of Dask and of pip."""

HEAD = "moma-survey 1\nobserver 1 -20 1\ndepth * 0.4 source measured at the door\n"
FACES = ((1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8))


def commands(group: typer.core.TyperGroup | None = None) -> Iterator[tuple[str, typer.core.TyperCommand]]:
    """Yield the names and commands of the program."""
    found = typer.main.get_command(app) if group is None else group
    for name, command in getattr(found, "commands", {}).items():
        yield name, command
        yield from commands(command)


def flags(only: str | None = None) -> dict[str, bool]:
    """Return the options of one command or of all, and whether each takes no value."""
    return {
        option: bool(getattr(parameter, "is_flag", False))
        for name, command in commands()
        if only in (None, name)
        for parameter in command.params
        for option in (*parameter.opts, *parameter.secondary_opts)
    } | {"--help": True, "--version": True}


def texts() -> Iterator[tuple[str, str]]:
    """Yield the texts of the source besides docstrings, with their places."""
    for path in (path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        place, source = str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")
        if not re.search("--[a-z]|moma [a-z]", source):
            continue
        tree = ast.parse(source)
        statements = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in statements:
                yield f"{place}:{node.lineno}", node.value


def test_every_option_and_command_that_a_message_names_exists() -> None:
    options, names = flags(), {name for name, _ in commands()}
    for place, text in texts():
        if place.partition(":")[0] not in PROGRAMS:
            unknown = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text)) - options.keys()
            assert not unknown, f"{place}: {unknown}"
        if " " in text:
            unknown = set(re.findall(r"\bmoma ([a-z-]+[a-z])(?= --| [A-Z]{2}|`)", text)) - names
            assert not unknown, f"{place}: {unknown}"


def advised(message: str, command: str = "ingest") -> list[str]:
    """Return the words of the first option in a message, as one would copy them."""
    found = re.search(r'(--[a-z][a-z-]*)(?: ("[^"]*"|[^\s;,]+))?', message)
    assert found is not None, message
    option, value = found[1], found[2]
    return [option] if flags(command)[option] else [option, str(value).strip('"').rstrip(":.")]


def with_advice(words: list[str], advice: list[str]) -> list[str]:
    """Return a command with the option that was advised, in place of what it had of it."""
    if advice[0] in words and len(advice) > 1:
        k = words.index(advice[0])
        words = [*words[:k], *words[k + 2 :]]
    return [*words, *advice]


def boxes(path: Path, scale: float = 1.0, upright: bool = True) -> Path:
    """Three boxes, one upon the others, as OBJ."""
    lines = []
    for k in range(3):
        x, z = (0.25, 0.3) if k == 2 else (0.6 * k, 0.0)
        corners = [(x + a, b, z + c) for c in (0, 0.3) for a, b in ((0, 0), (0.6, 0), (0.6, 0.4), (0, 0.4))]
        turned = corners if upright else [(a, c, -b) for a, b, c in corners]
        lines += [f"o S{k}", *(f"v {scale * a:g} {scale * b:g} {scale * c:g}" for a, b, c in turned)]
        lines += ["f " + " ".join(str(8 * k + i) for i in face) for face in FACES]
    path.write_text("\n".join(lines) + "\n")
    return path


def listed(path: Path, codes: str = "W{n}:v", header: str = "") -> Path:
    """Two stones as a list of point, easting, northing, elevation and code."""
    rows = [
        f"{4 * n + k},{0.6 * n + x:.3f},{0.001 * k:.3f},{z:.3f},{codes.format(n=n)}"
        for n in (1, 2)
        for k, (x, z) in enumerate(((0, 0), (0.5, 0), (0.5, 0.3), (0, 0.3)))
    ]
    path.write_text("\n".join([*([header] if header else []), *rows]) + "\n")
    return path


def outlines(path: Path, scale: float = 1.0, again: bool = False) -> Path:
    """Three outlines as plain JSON."""
    square = ((0.0, 0.0), (0.5, 0.0), (0.5, 0.3), (0.0, 0.3))
    stones = [
        {"code": f"S{k}", "outline": [(scale * (0.6 * k + x), scale * z) for x, z in square]}
        for k in range(3)
    ]
    path.write_text(json.dumps([*stones, *([stones[0]] if again else [])]))
    return path


CASES = {
    "millimetres": lambda at: ["ingest", boxes(at / "a.obj", 1000.0)],
    "y upwards": lambda at: ["ingest", boxes(at / "a.obj", upright=False)],
    "outlines in millimetres": lambda at: ["ingest", "--outlines", outlines(at / "o.json", 1000.0), "--depth", "0.4"],
    "a list without its format": lambda at: ["ingest", listed(at / "p.txt"), "--header", head(at)],
    "an order of axes": lambda at: [
        "ingest", listed(at / "p.txt", header="Point,Easting,Northing,Elevation,Code"),
        "--format", "pnezd", "--header", head(at),
    ],
    "codes of another form": lambda at: [
        "ingest", listed(at / "p.txt", "NW.01.{n:02d}.L.E"), "--format", "penzd", "--header", head(at),
        "--kinds", "L=stretcher",
    ],
    "codes without a role": lambda at: [
        "ingest", listed(at / "p.txt", "W{n}"), "--format", "penzd", "--header", head(at),
    ],
    "kinds of one letter": lambda at: [
        "ingest", listed(at / "p.txt", "W{n} B v"), "--format", "penzd", "--header", head(at),
        "--codes", "{block} {kind} {role}",
    ],
    "a stone twice": lambda at: ["ingest", "--outlines", outlines(at / "o.json", again=True), "--depth", "0.4",
                                 "--rejects", at / "r.geojson"],
}  # fmt: skip
"""Commands that are refused with advice that names an option."""


def head(at: Path) -> Path:
    path = at / "head.moma"
    path.write_text(HEAD)
    return path


@pytest.mark.parametrize("case", CASES)
def test_advice_works_when_it_is_copied(tmp_path: Path, case: str) -> None:
    words = [str(word) for word in CASES[case](tmp_path)] + ["--db", f"sqlite:///{tmp_path}/a.db"]
    followed = 0
    while (done := invoke(*words)).exit_code:
        message = done.stderr.splitlines()[-1]
        words = with_advice(words, advised(message.partition("; ")[2] or message))
        followed += 1
        assert followed < 4, message
    assert followed, "it was not refused"


def test_a_file_read_otherwise_takes_the_place_of_what_was_stored(tmp_path: Path) -> None:
    words = ["ingest", str(boxes(tmp_path / "a.obj")), "--db", f"sqlite:///{tmp_path}/a.db"]
    assert invoke(*words).exit_code == 0
    done = invoke(*words, "--snap", "0.001")
    assert done.exit_code
    assert invoke(*words, "--snap", "0.001", *advised(done.stderr.splitlines()[-1])).exit_code == 0


def test_a_scene_of_stones_without_courses_names_the_lowest(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path}/a.db"
    words = ["--outlines", str(outlines(tmp_path / "o.json")), "--depth", "0.4"]
    assert invoke("ingest", *words, "--db", url).exit_code == 0
    scene = tmp_path / "a.toml"
    stone = "[materials.stone]\ndensity = 2300\nyoung = 1e10\npoisson = 0.2\n"
    text = f'[scene]\nname = "a"\n[select]\nkind = "ashlar"\n{stone}'
    scene.write_text(f'{text}[bodies]\ndefault = "rigid"\nfixed = ["course = 1"]\n')
    message = invoke("check", str(scene), "--db", url).stderr
    lowest = re.search(r"no selected stone has a course: .* the lowest are (\[.*\])", message)
    assert lowest is not None, message
    assert lowest[1] == '["S0", "S1", "S2"]'
    scene.write_text(f'{text}[bodies]\ndefault = "rigid"\nfixed = {lowest[1]}\n')
    assert "3 fixed" in invoke("check", str(scene), "--db", url).stdout
