"""Fixed words of the pages in other languages: one TOML file of `words` for each.

A file holds the ``name`` of its language in that language, and a table ``words`` of texts by the English ones, in which
``{}`` stands for any text. What a file lacks stays English.
"""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def catalogues() -> dict[str, dict[str, Any]]:
    """Return name and words of each language by its tag, English first."""
    folder = files("pipelines.reports.page") / "words"
    found = {
        path.name.removesuffix(".toml"): tomllib.loads(path.read_text(encoding="utf-8"))
        for path in sorted(folder.iterdir(), key=lambda one: one.name)
        if path.name.endswith(".toml")
    }
    return {"en": {"name": "English", "words": {}}, **found}
