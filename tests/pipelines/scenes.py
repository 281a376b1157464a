"""Scenes in tests: surveys of a few stones, assembly from a database, and the line of the error in a wrong scene."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from archmodel.database.session import open_database
from ground.errors import SceneError
from mechanics.arrays import Array
from pipelines.run.assemble import Assembly, assemble
from pipelines.scene.file import parse_scene
from tests.paths import ROOT

# the two lowest courses of the sample, the first fixed
TWO_COURSES = """
[scene]
name = "Two courses"
[select]
where = ["course <= 2"]
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["course = 1"]
"""
# the same with one deformable stone
TWO_COURSES_MIXED = TWO_COURSES.replace("fixed =", 'deformable = ["W02-02"]\nfixed =')
# all of three stones of a survey made by `survey_text`
THREE_STONES = TWO_COURSES.replace("Two courses", "Three stones").replace("course <= 2", "depth > 0")


def assembled(url: str, text: str) -> Assembly:
    """Assemble a scene from the stones of a database."""
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        return assemble(parse_scene(text, "scene.toml"), session)


def fails_at_line(line: int, words: str, build: Callable[[str], object], text: str) -> None:
    """Check that what is built of a text fails in one line, which names the line of the scene, with exit code 2."""
    with pytest.raises(SceneError) as caught:
        build(text)
    message = str(caught.value)
    assert message.startswith(f"scene.toml:{line}: ")
    assert words in message
    assert "\n" not in message
    assert caught.value.exit_code == 2


def survey_text(stones: Mapping[str, tuple[int, Array, Array]], shift: Array) -> str:
    """Write a survey of headers: by code the course, the corners (4, 3) and points (n, 3) of the face, shifted [m]."""
    observer = (shift + np.array([0.5, -9.0, 1.0])).tolist()
    lines = [
        "moma-survey 1",
        f"observer {' '.join(map(repr, observer))}",
        "sigma 0.002",
        "depth * 0.4 sigma 0.02 source thickness",
    ]
    for code, (course, corners, points) in stones.items():
        lines.append(f"stone {code} header course {course}")
        for word, places in (("vertex", corners), ("point", points)):
            lines += [f"{word} {' '.join(map(repr, place))}" for place in (places + shift).tolist()]
        lines.append("end")
    return "\n".join(lines) + "\n"


def small_geology(folder: Path) -> None:
    """Write the shipped geological scenes into a folder, a tenth as large, without cells, for a few steps."""
    folder.mkdir(parents=True)
    small = {"length": 0.1, "deep_length": 0.1, "slope_end": 0.1, "tip": 0.1}
    small |= {"thickness": 0.5, "top": 0.5, "deep": 0.5, "width": 0.3, "height": 0.3}
    small |= {"strain": 0.01, "push": 0.01}
    for path in (ROOT / "data/samples/geology").glob("*.toml"):
        lines = path.read_text(encoding="utf-8").partition("\n[[cells]]")[0].splitlines()
        for number, line in enumerate(lines):
            name, _, value = line.partition(" = ")
            if name in small:
                lines[number] = f"{name} = {float(value) * small[name]:.4g}"
            elif name == "steps":
                lines[number] = "steps = 4"
        (folder / path.name).write_text("\n".join(lines) + "\n", encoding="utf-8")
