"""Scenes in tests: their assembly from a database, and the line of the error in a wrong one."""

from collections.abc import Callable

import pytest

from archmodel.database.session import open_database
from moma.errors import SceneError
from pipelines.run.assemble import Assembly, assemble
from pipelines.scene.file import parse_scene

__all__ = ["assembled", "fails_at_line"]


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
