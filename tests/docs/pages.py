"""Pages of the documentation: their blocks, and what their commands and scripts print.

All run within the process of the test: another one needs 3 s to load what they use.
"""

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest

from synthetic.__main__ import written
from tests.moma.commands import prints
from tests.paths import ROOT


def blocks(page: str, language: str) -> list[str]:
    """The fenced blocks of a page in a language, in their order."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def ran(folder: Path, commands: str) -> dict[str, str]:
    """What each command prints, by its line; all run in `folder`."""
    said = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("MOMA_DB", raising=False)
        for line in commands.splitlines():
            words = shlex.split(line)
            if words[:3] == ["python", "-m", "synthetic"]:
                said[line] = written(words[3:]).title
            else:
                said[line] = prints(*words[1:])
    return said


def printed(folder: Path, script: str) -> str:
    """What a script of a page prints, in `folder`; warnings are errors, as in all tests."""
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        patch.chdir(folder)
        patch.delenv("MOMA_DB", raising=False)
        exec(compile(script, "the page", "exec"), {"__name__": "__main__"})
    return said.getvalue()
