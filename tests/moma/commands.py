"""The command line, run within the process of a test."""

import json
from typing import Any

from typer.testing import CliRunner, Result

from moma.cli import app


def invoke(*words: object) -> Result:
    """Run a command, however it ends."""
    return CliRunner().invoke(app, [str(word) for word in words])


def prints(*words: object) -> str:
    """Run a command that must succeed; return its standard output."""
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    return done.stdout


def answer(*words: object) -> Any:
    """Run a command that must succeed; return what it answers to programs."""
    return json.loads(prints(*words, "--json"))


def fails(code: int, *words: object) -> str:
    """Run a command that must fail with one line and nothing else except its progress; return the line."""
    done = invoke(*words)
    assert done.exit_code == code, done.output
    assert done.stdout == ""
    (line,) = [one for one in done.stderr.splitlines() if not one.startswith(("moma: [", "moma: compiling"))]
    assert line.startswith("moma: error: ")
    return line
