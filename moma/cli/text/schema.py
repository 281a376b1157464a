"""Text of ``moma schema``: a tree of kinds with their attributes, then structures and relations."""

import sys
from collections.abc import Iterator, Mapping
from typing import Any

Branch = Mapping[str, Any]


def print_schema(schema: Branch) -> None:
    """Print the tree, in colours on a terminal."""
    if not sys.stdout.isatty():
        print("\n".join(schema_lines(schema)))
        return
    from rich.console import Console
    from rich.text import Text

    console = Console(highlight=False)
    for line in schema_lines(schema):
        text = Text(line)
        text.highlight_regex(r"(?<=── )[a-z_0-9]+(?=  )|^[a-z_0-9]+(?=  )", "bold")
        text.highlight_regex(r"canonical:|registered(, a case of [a-z_0-9]+)?:", "italic")
        text.highlight_regex(r"^[│├└─ ]+", "dim")
        text.highlight_regex(r"(?<=· )[a-z_0-9]+", "cyan")
        console.print(text, soft_wrap=True)


def schema_lines(schema: Branch) -> Iterator[str]:
    """Yield the lines, without colours."""
    for root in schema["kinds"]:
        yield from _kind_lines(root, "", "")
    for title, key, name in (("Structures", "structures", "kind"), ("Relations", "relations", "relation")):
        if key in schema:
            if schema["kinds"]:
                yield ""
            yield title
            width = max(len(one[name]) for one in schema[key])
            yield from (f"  {one[name]:<{width}}  {_origin(one)}{one['definition']}" for one in schema[key])
    if schema.get("terms"):
        yield ""
        yield "Terms"
        yield from (f"  {_term(one)}" for one in schema["terms"])
    if "attributes" in schema:
        yield ""
        yield "Attributes of every entity"
        yield from (f"  {_attribute(attribute)}" for attribute in schema["attributes"])


def _kind_lines(branch: Branch, first: str, rest: str) -> Iterator[str]:
    """Yield a kind, its attributes and subkinds; `first` and `rest` begin the first line and those below."""
    yield f"{first}{branch['kind']}  {_origin(branch)}{branch['definition']}"
    below = rest + ("│   " if branch["kinds"] else "    ")
    if branch["canonical"] is not None:
        yield f"{below}canonical: {branch['canonical']}"
    for attribute in branch["attributes"]:
        yield f"{below}· {_attribute(attribute)}"
    for number, sub in enumerate(branch["kinds"], start=1):
        last = number == len(branch["kinds"])
        yield from _kind_lines(sub, rest + ("└── " if last else "├── "), rest + ("    " if last else "│   "))


def _origin(kind: Branch) -> str:
    """Return what marks a registered kind; with its parent, where the tree does not show it."""
    if not kind.get("registered"):
        return ""
    return f"registered, a case of {kind['parent']}: " if "parent" in kind else "registered: "


def _term(term: Branch) -> str:
    """Format a term: observation lichen, a case of stain: definition (de Flechten)."""
    above = f", a case of {term['broader']}" if term["broader"] else ""
    labels = ", ".join(f"{language} {' / '.join(names)}" for language, names in term["labels"].items())
    return f"{term['vocabulary']} {term['term']}{above}: {term['definition'] or ''}{f' ({labels})' if labels else ''}"


def _attribute(attribute: Branch) -> str:
    unit = "" if attribute["unit"] in (None, "-") else f" [{attribute['unit']}]"
    return f"{attribute['name']}{unit}: {attribute['definition']}"
