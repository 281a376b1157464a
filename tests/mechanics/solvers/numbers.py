"""The numbers of mechanics/solvers, and what a third and three times each do to a fixed set of problems and scenes.

A number is a literal in an assignment of a module, or in a default of a field or an argument. Not counted are 0 and 1,
subscripts, the defaults of tolerances and iterations that all methods repeat, and sizes of arrays. Run as
`python -m tests.mechanics.solvers.numbers` it lists them; with names after it, or `all`, it changes those, each in a
process of its own, and prints the figures of the table in docs/design/solvers.md, and processor times.
"""

import ast
import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from math import exp, log
from pathlib import Path
from statistics import fmean
from types import CodeType
from typing import TYPE_CHECKING

from tests.paths import ROOT

if TYPE_CHECKING:
    from mechanics.problem.problem import ContactProblem, ContactSolution
    from mechanics.scene.scene import Method

PACKAGE = "mechanics.solvers"
STORED = ROOT.parent / "shared/data/fc3d"
REPEATED = ("tolerance", "velocity_tolerance", "max_iterations")
SIZES = ("_SPACE", "_VELOCITIES", "_MIRROR", "ROWS", "ARM")
"""Names, or first names, of assignments that give sizes and places of arrays."""
WILD = {
    "gapped_wall": "fast-relaxed-rest-2ms",
    "beam_on_one_sliver": "fast-plain-static-5ms",
    "rest_just_below_friction": "fast-plain-rest-2ms",
    "sliver_at_the_side": "balanced-relaxed-rest-5ms",
}
"""Scenes of the wild matrix and their settings: rest and fall, with a static start and without."""
COUNTED: list[int] = []
"""Iterations of all methods, of chains and of single ones."""


@dataclass(frozen=True)
class Number:
    """A number, the module that holds it, the first name of its assignment, and its place in the file."""

    module: str
    name: str
    value: float
    place: tuple[int, int]


def numbers(package: str = PACKAGE) -> list[Number]:
    """Return all numbers of a package, module by module."""
    found = []
    for path in sorted((ROOT / package.replace(".", "/")).rglob("*.py")):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for name, tree in _assigned(ast.parse(path.read_text(encoding="utf-8"))):
            known = [one for one in _literals(tree) if one.value not in (0, 1)]
            found += [Number(module, name, one.value, (one.lineno, one.col_offset)) for one in known]
    return found


def _assigned(module: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Yield assignments and defaults that count."""
    for node in module.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            target = ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)
            name = target.strip("()").split(",")[0]
            if name not in SIZES:
                yield name, node.value
    for node in ast.walk(module):
        if isinstance(node, ast.ClassDef):
            for field in node.body:
                if not isinstance(field, ast.AnnAssign) or field.value is None:
                    continue
                if (name := ast.unparse(field.target)) not in REPEATED:
                    yield f"{node.name}.{name}", field.value
        elif isinstance(node, ast.FunctionDef):
            for default in (*node.args.defaults, *node.args.kw_defaults):
                if default is not None:
                    yield f"{node.name}()", default


def _literals(tree: ast.AST) -> Iterator[ast.Constant]:
    if isinstance(tree, ast.Constant) and type(tree.value) in (int, float):
        yield tree
    for child in ast.iter_child_nodes(tree):
        if not (isinstance(tree, ast.Subscript) and child is tree.slice):
            yield from _literals(child)


def changed(value: float, factor: float) -> float:
    """Return a number times a factor; of a part near one, the rest to one times it; a count is at least one."""
    if isinstance(value, int):
        return max(1, round(factor * value))
    return 1.0 - (1.0 - value) / factor if 0.5 < value < 1.0 else factor * value


class _Change(ast.NodeTransformer):
    """Put a value in a place, and let nothing compiled be read from or written to the cache."""

    def __init__(self, place: tuple[int, int] | None, value: float) -> None:
        self._place, self._value = place, value

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if (node.lineno, node.col_offset) != self._place:
            return node
        return ast.copy_location(ast.Constant(self._value), node)

    def visit_keyword(self, node: ast.keyword) -> ast.AST:
        self.generic_visit(node)
        if node.arg == "cache":
            node.value = ast.copy_location(ast.Constant(False), node.value)
        return node


class _Changed(SourceFileLoader):
    """Loader of a module with another number in it."""

    def __init__(self, name: str, path: str, change: _Change) -> None:
        super().__init__(name, path)
        self._change = change

    def get_code(self, fullname: str) -> CodeType:
        tree = self._change.visit(ast.parse(Path(self.path).read_text(encoding="utf-8")))
        return compile(ast.fix_missing_locations(tree), self.path, "exec")


@dataclass(frozen=True)
class Finder(MetaPathFinder):
    """Finder of the module of a number, with another value; put first on `sys.meta_path` before it is imported.

    Compiled functions hold numbers of each other: where the number is one of theirs, none is read from the cache.
    """

    number: Number
    value: float

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        compiled = "_kernels." in self.number.module and fullname.startswith(f"{PACKAGE}._kernels.")
        if fullname != self.number.module and not compiled:
            return None
        file = str(ROOT / (fullname.replace(".", "/") + ".py"))
        place = self.number.place if fullname == self.number.module else None
        return spec_from_file_location(
            fullname, file, loader=_Changed(fullname, file, _Change(place, self.value))
        )


def entries() -> dict[str, Callable[[], str]]:
    """Return the set: one problem of every kind, stored ones, one by every method, and scenes; each gives a verdict.

    Nothing of the solvers is imported before: a number may be another one.
    """
    from benchmarks.stored import read_problem
    from mechanics.scene.scene import Method
    from tests.mechanics.solvers.test_kinds import KINDS

    found: dict[str, Callable[[], str]] = {}
    for name, kind in KINDS.items():
        found[name] = partial(_of_problem, kind.problem(), Method.AUTO, 1e-6)
    for path in sorted(STORED.glob("*.npz")):
        found[path.stem] = partial(_of_problem, read_problem(path), Method.AUTO, 1e-8)
    few = KINDS["few rigid"].problem()
    for method in set(Method) - {Method.AUTO}:
        found[f"few rigid by {method}"] = partial(_of_problem, few, method, 1e-6)
    found["many fall"] = _of_fall
    for name, setting in WILD.items():
        found[name] = partial(_of_scene, name, setting)
    return found


def _of_problem(problem: "ContactProblem", method: "Method", eta: float) -> str:
    from mechanics.problem.residual import residual
    from mechanics.scene.scene import SolverSettings
    from mechanics.solvers.choice import choose_solver
    from tests.mechanics.solvers.problems import cold

    settings = SolverSettings(method, eta, 10 * eta, 20_000)
    solution = choose_solver(settings)(problem, cold(problem))
    if not COUNTED:
        COUNTED.append(solution.iterations)
    return "solved" if residual(problem, solution.impulse).within(eta, 10 * eta) else "not solved"


def _of_fall() -> str:
    """Three steps of a wall of 64 bricks that slides and topples, in motion from the first."""
    from mechanics.simulate import simulate
    from tests.mechanics.solvers.problems import leaning

    one = leaning(0.8, 8, 8, duration=0.015)
    found = simulate(replace(one, time=replace(one.time, relaxation=False)))
    return str(found.outcome)


def _of_scene(name: str, setting: str) -> str:
    from tests.validation.wild.matrix import SETTINGS, run

    return str(run(name, next(one for one in SETTINGS if str(one) == setting)).outcome)


def measure() -> dict[str, tuple[str, int, float]]:
    """Return the verdict on each entry, the iterations of all methods, and processor time [s]."""
    from mechanics.solvers import auto, chain, from_nothing

    known = entries()
    follow = chain.follow
    for module in (chain, auto, from_nothing):
        module.follow = partial(_counted, follow)  # type: ignore[attr-defined]
    found = {}
    for name, entry in known.items():
        COUNTED.clear()
        began = time.process_time()
        try:
            verdict = entry()
        except Exception as error:
            verdict = type(error).__name__
        found[name] = verdict, sum(COUNTED), time.process_time() - began
    return found


def _counted(follow: "Callable[..., ContactSolution]", *given: object) -> "ContactSolution":
    found = follow(*given)
    COUNTED.append(found.iterations)
    return found


def apart(number: Number | None = None, value: float = 0.0) -> dict[str, tuple[str, int, float]]:
    """Return what a process of its own measures, of the set with another value; empty where it fails."""
    read, write = os.pipe()
    if (child := os.fork()) == 0:
        try:
            if number is not None:
                sys.meta_path.insert(0, Finder(number, value))
            with os.fdopen(write, "w") as said:
                json.dump(measure(), said)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as said:
        found = said.read()
    os.waitpid(child, 0)
    return json.loads(found) if found else {}


def forget() -> None:
    """Import what the set needs, and forget what is ours of it, which a changed number may change."""
    entries()
    for name in [
        one for one in sys.modules if one.split(".")[0] in ("benchmarks", "mechanics", "pipelines", "tests")
    ]:
        del sys.modules[name]


def row(number: Number, usual: dict[str, tuple[str, int, float]]) -> str:
    """Return the row of a number: its value, and of a third and three times it, what differs."""
    told = []
    for factor in (1 / 3, 3.0):
        value = changed(number.value, factor)
        found = apart(number, value)
        work = (
            fmean(log((1 + one[1]) / (1 + usual[name][1])) for name, one in found.items()) if found else 0.0
        )
        seconds = sum(one[2] for one in found.values()) / sum(one[2] for one in usual.values())
        differ = [f"{name}: {one[0]}" for name, one in found.items() if one[0] != usual[name][0]]
        said = "; ".join(differ) or "same verdicts"
        told.append(
            f"{value:.3g}: {exp(work):.2f}, {seconds:.2f}, {said}" if found else f"{value:.3g}: fails"
        )
    return f"| {number.module.removeprefix(PACKAGE + '.')} `{number.name}` | {number.value:g} | {told[0]} | {told[1]} |"


def main() -> None:
    """List the numbers, or change some."""
    asked = sys.argv[1:]
    every = numbers()
    if not asked:
        for one in every:
            print(f"{one.module.removeprefix(PACKAGE + '.'):32s} {one.name:24s} {one.value:g}")
        print(f"{len(every)} numbers")
        return
    # threads of the linear algebra that wait for each other take ten times as long
    os.environ["OMP_NUM_THREADS"] = "1"
    forget()
    usual = apart()
    for one in every:
        if one.name in asked or asked == ["all"]:
            print(row(one, usual), flush=True)


if __name__ == "__main__":
    main()
