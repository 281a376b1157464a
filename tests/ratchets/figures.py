"""Figures of the source that may only fall: `python -m tests.ratchets.figures` prints them; with a name, the places.

Numbers are those of `tests.mechanics.solvers.numbers`, for any package. Identifiers are names, attributes, arguments,
keywords and definitions; the listed words count where they are a whole identifier. A function is long with more than 60
lines, wide with more than nine parameters, and undocumented where it is public and has no docstring.
"""

import ast
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partial

from tests.mechanics.solvers.numbers import numbers
from tests.paths import ROOT

PACKAGES = ("ground", "moma", "survey", "archmodel", "mechanics", "pipelines")
# they name no thing of the field
WORDS = {
    *("one", "own", "other", "part", "way", "near", "far"),
    *("found", "told", "said", "held", "known", "kept", "left", "given"),
}
LINES, PARAMETERS = 60, 9

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass
class Source:
    """Places of the source, as text: its identifiers among `WORDS`, its functions, and how many identifiers it has."""

    identifiers: int = 0
    empty: list[tuple[str, str]] = field(default_factory=list)
    long: list[str] = field(default_factory=list)
    wide: list[str] = field(default_factory=list)
    undocumented: list[str] = field(default_factory=list)


@cache
def source() -> Source:
    """Read all modules, once."""
    found = Source()
    for path in (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))):
        tree, place = ast.parse(path.read_text(encoding="utf-8")), path.relative_to(ROOT)
        for node in ast.walk(tree):
            if (name := identifier(node)) is not None:
                found.identifiers += 1
                if (word := name.strip("_").lower()) in WORDS:
                    found.empty.append((word, f"{place}:{node.lineno}: {name}"))  # type: ignore[attr-defined]
            if isinstance(node, Function):
                add_function(found, f"{place}:{node.lineno}: {node.name}", node)
    return found


def add_function(found: Source, place: str, function: Function) -> None:
    """Add a function where it is long, wide or undocumented."""
    if (function.end_lineno or 0) - function.lineno >= LINES:
        found.long.append(place)
    if len(parameters(function)) > PARAMETERS:
        found.wide.append(place)
    if function.name[0] != "_" and ast.get_docstring(function) is None:
        found.undocumented.append(place)


@cache
def numbers_of(package: str) -> list[str]:
    """Return the places of the numeric constants of a package."""
    return [f"{one.module}:{one.place[0]}: {one.name} = {one.value:g}" for one in numbers(package)]


def identifier(node: ast.AST) -> str | None:
    """Return the identifier that a node of a syntax tree holds; None where it holds none.

    >>> tree = ast.parse("from a.b import c\\ndef f(x): return g(y=x.z)")
    >>> sorted(filter(None, map(identifier, ast.walk(tree))))
    ['c', 'f', 'g', 'x', 'x', 'y', 'z']
    """
    match node:
        case ast.Name():
            return node.id
        case ast.Attribute():
            return node.attr
        case ast.arg() | ast.keyword():
            return node.arg
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            return node.name
        case ast.alias():
            return (node.asname or node.name).rpartition(".")[2]
    return None


def empty_words(words: set[str] = WORDS) -> list[str]:
    """Return the places of identifiers that say nothing of what they name."""
    return [place for word, place in source().empty if word in words]


def per_10_000(words: set[str]) -> int:
    """Return how many of 10,000 identifiers are among these words, rounded up."""
    return -(-10_000 * len(empty_words(words)) // source().identifiers)


def parameters(function: Function) -> list[str]:
    """Return the names of the parameters of a function, those of a method without the object itself.

    >>> parameters(ast.parse("def f(self, a, /, b, *c, d=1, **e): ...").body[0])
    ['a', 'b', 'd', 'c', 'e']
    """
    listed = function.args
    plain = [*listed.posonlyargs, *listed.args, *listed.kwonlyargs]
    gathered = [argument for argument in (listed.vararg, listed.kwarg) if argument is not None]
    return [argument.arg for argument in (*plain, *gathered) if argument.arg not in ("self", "cls")]


FIGURES: dict[str, Callable[[], list[str]]] = {
    **{f"numbers of {package}": partial(numbers_of, package) for package in PACKAGES},
    "empty identifiers": empty_words,
    "long functions": lambda: source().long,
    "wide functions": lambda: source().wide,
    "undocumented functions": lambda: source().undocumented,
}
"""Lists of the places that a figure counts, by its name."""


def main() -> None:
    """Print all figures, or the places of those that are named."""
    for name in sys.argv[1:]:
        print(*FIGURES[name](), sep="\n")
    if not sys.argv[1:]:
        for name, places in FIGURES.items():
            print(f"{len(places()):6d} {name}")
        print(f"{per_10_000(WORDS):6d} of 10,000 identifiers are empty words, {per_10_000({'one'})} `one`")


if __name__ == "__main__":
    main()
