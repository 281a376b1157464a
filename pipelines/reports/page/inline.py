"""The viewer inside a page: style, modules and data, in one file without a build step.

The modules of `viewer` are plain ES modules that name each other by ``import { … } from "./name.js"``. In a page they
stand one after another as one module: imports left out, ``export`` too. So no name may stand in two of them.
"""

import base64
import gzip
import json
import re
from functools import cache
from importlib.resources import files

from markupsafe import Markup

from pipelines.reports.page.languages import catalogues
from pipelines.reports.page.model import Model
from pipelines.reports.page.packing import pack

MODULES = ("data", "vectors", "colours", "words", "camera", "renderer", "stage", "panel", "viewer", "main")
"""Modules, each after those that it imports."""

_IMPORT = re.compile(r"^import .*?;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)
_DATA = re.compile(r'<script type="application/octet-stream" id="(view-\d+)">([A-Za-z0-9+/=]*)</script>')


def module_text(name: str) -> str:
    """Return the text of a file of the viewer."""
    return (files("pipelines.reports.page") / "viewer" / name).read_text(encoding="utf-8")


@cache
def style() -> Markup:
    """Return the rules of the viewer."""
    return Markup(module_text("viewer.css"))  # a file of this package


@cache
def script() -> Markup:
    """Return all modules as one."""
    parts = (_EXPORT.sub("", _IMPORT.sub("", module_text(f"{name}.js"))) for name in MODULES)
    return Markup("\n".join(part.strip() for part in parts))  # files of this package


@cache
def languages_packed() -> Markup:
    """Return the catalogues of all languages as JSON, gzipped, in base64."""
    text = json.dumps(catalogues(), ensure_ascii=False).encode()
    return Markup(base64.b64encode(gzip.compress(text, 9, mtime=0)).decode("ascii"))


def viewer_html(model: Model) -> Markup:
    """Return the element of a viewer and its data."""
    return again([pack(model)])


def _html(packed: str, number: int) -> Markup:
    link = " data-link" if number == 1 else ""
    return Markup(
        f'<section class="moma-viewer" data-model="view-{number}"{link}></section>\n'
        f'<script type="application/octet-stream" id="view-{number}">{packed}</script>'
    )


def packed_models(page: str) -> list[str]:
    """Return the packed models of the viewers in a written page."""
    return [found[2] for found in _DATA.finditer(page)]


def again(packed: list[str]) -> Markup:
    """Return viewers of models that are packed already, side by side and linked."""
    return Markup("\n").join(_html(one, number) for number, one in enumerate(packed, start=1))
