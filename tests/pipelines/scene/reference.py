"""Tables of docs/scene.md, generated from the keys: `python -m tests.pipelines.scene.reference docs/scene.md`."""

import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from ground.toml.schema import REQUIRED, Key
from pipelines.scene.file import MATERIAL_KEYS, MESH_KEYS, ORTHOTROPY_KEYS, SITE_KEYS, TABLES
from pipelines.scene.laws import LAW_KEYS, LAW_TYPES
from pipelines.scene.loads import ASSESS_TYPES, LOAD_KEYS, LOAD_TYPES, THROW_KEYS
from pipelines.scene.pushover import PUSHOVER_KEYS, SCATTER_KEYS
from pipelines.scene.stages import STAGE_KEYS

_HEAD = ("| key | unit | default | meaning |", "|---|---|---|---|")
_HEADING = re.compile(r'(##|###) `(?:type = "(\w+)"|(\[.+\]))`')

SECTIONS: Mapping[str, tuple[Key, ...]] = {
    **{f"[{name}]": keys for name, keys in TABLES.items()},
    "[materials.NAME]": MATERIAL_KEYS,
    "[materials.NAME.orthotropy]": ORTHOTROPY_KEYS,
    "[[meshes]]": MESH_KEYS,
    "[[laws]]": LAW_KEYS,
    **{f"[[laws]] {name}": keys for name, keys in LAW_TYPES.items()},
    "[[loads]]": LOAD_KEYS,
    **{f"[[loads]] {name}": keys for name, keys in LOAD_TYPES.items()},
    "[[throw]]": THROW_KEYS,
    "[[stages]]": STAGE_KEYS,
    **{f"[[assess]] {name}": keys for name, keys in ASSESS_TYPES.items()},
    "[site]": SITE_KEYS,
    "[pushover]": PUSHOVER_KEYS,
    "[pushover.scatter]": SCATTER_KEYS,
}
"""Keys by heading of the page; those of a type follow the heading of its array."""


def with_tables(page: str) -> str:
    """Return the page with its tables of keys renewed.

    Raises
    ------
    LookupError : a section is missing from the page, or has no table
    """
    waiting, lines = dict(SECTIONS), list[str]()
    table, section, old = "", "", False
    for line in page.splitlines():
        if heading := _HEADING.fullmatch(line):
            table = heading[3] or table
            section = f"{table} {heading[2]}" if heading[2] else table
        if line == _HEAD[0]:
            old = True
            lines += _rows(waiting.pop(section))
        old = old and line.startswith("|")
        if not old:
            lines.append(line)
    if waiting:
        raise LookupError(f"no tables of keys in the sections {', '.join(waiting)}")
    return "\n".join(lines) + "\n"


def _rows(keys: Iterable[Key]) -> Iterator[str]:
    yield from _HEAD
    for key in keys:
        yield f"| `{key.name}` | {key.unit} | {_default(key.default)} | {key.doc} |"


def _default(value: object) -> str:
    """Return a default in TOML; None, which has a meaning of its own, is left blank."""
    if value is REQUIRED:
        return "required"
    return "" if value is None else f"`{_toml(value)}`"


def _toml(value: object) -> str:
    match value:
        case bool():
            return str(value).lower()
        case tuple():
            return f"[{', '.join(map(_toml, value))}]"
        case str():
            return f'"{value}"'
        case _:
            return f"{value:g}"


if __name__ == "__main__":
    page = Path(sys.argv[1])
    page.write_text(with_tables(page.read_text(encoding="utf-8")), encoding="utf-8")
