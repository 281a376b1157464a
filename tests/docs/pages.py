"""Pages of the documentation: their blocks, and what their commands print."""

import re
import shlex
from pathlib import Path

import pytest

from tests.moma.commands import prints
from tests.paths import ROOT

__all__ = ["blocks", "ran"]


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
            said[line] = prints(*shlex.split(line)[1:])
    return said
