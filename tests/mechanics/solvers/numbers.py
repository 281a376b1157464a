"""The numbers of mechanics/solvers, and how half and twice of one change a fixed set of problems and scenes.

A number is a literal in an assignment of a module, or in a default of a field or an argument. Not counted are 0 and 1,
subscripts, the defaults of tolerances and iterations that all methods repeat, and sizes of arrays. Run it as
`python -m tests.mechanics.solvers.numbers`: it lists them; with names after it, it changes those.
"""

import ast
import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path

from benchmarks.stored import read_problem
from mechanics.problem.problem import ContactProblem, ContactSolution
from mechanics.problem.residual import residual
from mechanics.scene.scene import Method, SolverSettings
from tests.mechanics.solvers.problems import cold
from tests.paths import ROOT

PACKAGE = "mechanics.solvers"
STORED = ROOT.parent / "shared/data/fc3d"
REPEATED = ("tolerance", "velocity_tolerance", "max_iterations")
SIZES = ("_SPACE", "_VELOCITIES", "_MIRROR", "ROWS", "ARM")
"""Names, or first names, of assignments that give sizes and places of arrays."""
WILD = {
    "arch_of_21_above_its_least_thickness": "balanced-relaxed-rest-5ms",
    "gapped_wall": "fast-relaxed-rest-2ms",
    "beam_on_one_sliver": "fast-plain-static-5ms",
    "rest_just_below_friction": "fast-plain-rest-2ms",
    "sliver_at_the_side": "balanced-relaxed-rest-5ms",
    "table_tilted_inside": "balanced-plain-rest-5ms",
}
"""Scenes of the wild matrix and their settings: rest and fall, with a static start and without."""


DEAR = "few deformable among rigid"
"""Kind of problem that takes longer than all others together."""


SINGLE = (Method.NSGS, Method.ADMM, Method.NEWTON)
"""Methods without a chain, which counts iterations."""
COUNTED: list[int] = []


@dataclass(frozen=True)
class Number:
    """A number, the module that holds it, the first name of its assignment, and its place in the file."""

    module: str
    name: str
    value: float
    place: tuple[int, int]


def numbers() -> list[Number]:
    """Return all numbers, module by module."""
    found = []
    for path in sorted((ROOT / PACKAGE.replace(".", "/")).rglob("*.py")):
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
    def __init__(self, place: tuple[int, int], value: float) -> None:
        self._place, self._value = place, value

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if (node.lineno, node.col_offset) != self._place:
            return node
        return ast.copy_location(ast.Constant(self._value), node)


def change(number: Number, value: float) -> None:
    """Run with another value from now on: every module that knows of it is executed again."""
    pure = [name for name in sys.modules if name.startswith(PACKAGE + ".") and "_kernels" not in name]
    source = {name: Path(sys.modules[name].__file__).read_text(encoding="utf-8") for name in pure}
    needs = {name: {other for other in pure if f"from {other} import" in source[name]} for name in pure}
    stale, before = {number.module}, {}
    while more := {name for name in pure if needs[name] & stale} - stale:
        stale |= more
    ordered: list[str] = []
    while len(ordered) < len(stale):
        ordered += sorted(name for name in stale - set(ordered) if not (needs[name] & stale) - set(ordered))
    for name in ordered:
        tree = ast.parse(source[name])
        if name == number.module:
            tree = ast.fix_missing_locations(_Change(number.place, value).visit(tree))
        space = vars(sys.modules[name])
        old = dict(space)
        exec(compile(tree, space["__file__"], "exec"), space)
        before |= {id(old[key]): space[key] for key in space["__all__"] if key in old}
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] in ("mechanics", "pipelines", "benchmarks") and name not in ordered:
            for key, known in list(vars(module).items()):
                if id(known) in before:
                    setattr(module, key, before[id(known)])


def entries() -> dict[str, Callable[[], str]]:
    """Return the set: one problem of every kind, stored ones, one by every method, and scenes; each gives a verdict."""
    from tests.mechanics.solvers.test_kinds import KINDS

    found: dict[str, Callable[[], str]] = {}
    for name, kind in KINDS.items():
        if name == DEAR:
            continue
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


def _of_problem(problem: ContactProblem, method: Method, eta: float) -> str:
    settings = SolverSettings(method, eta, 10 * eta, 20_000)
    solution = import_module(f"{PACKAGE}.choice").choose_solver(settings)(problem, cold(problem))
    if method in SINGLE:
        COUNTED.append(solution.iterations)
    return "solved" if residual(problem, solution.impulse).within(eta, 10 * eta) else "not solved"


def _of_fall() -> str:
    """Six steps of a wall of 64 bricks that slides and topples, in motion from the first."""
    from mechanics.simulate import simulate
    from tests.mechanics.solvers.problems import leaning

    one = leaning(0.8, 8, 8, duration=0.03)
    found = simulate(replace(one, time=replace(one.time, relaxation=False)))
    return str(found.outcome)


def _of_scene(name: str, setting: str) -> str:
    from tests.validation.wild.matrix import SETTINGS, run

    return str(run(name, next(one for one in SETTINGS if str(one) == setting)).outcome)


def measure(known: dict[str, Callable[[], str]]) -> dict[str, tuple[str, int]]:
    """Return the verdict on each entry, and the iterations of all methods: processor times differ by half at random."""
    chain = import_module(f"{PACKAGE}.chain")
    follow = getattr(chain.follow, "args", [chain.follow])[0]
    for name in ("chain", "auto", "from_nothing"):
        vars(import_module(f"{PACKAGE}.{name}"))["follow"] = partial(_counted, follow)
    found = {}
    for name, entry in known.items():
        COUNTED.clear()
        try:
            verdict = entry()
        except Exception as error:
            verdict = type(error).__name__
        found[name] = verdict, sum(COUNTED)
    return found


def _counted(follow: Callable[..., ContactSolution], *given: object) -> ContactSolution:
    found = follow(*given)
    COUNTED.append(found.iterations)
    return found


def apart(known: dict[str, Callable[[], str]], number: Number, value: float) -> dict[str, tuple[str, int]]:
    """Return the same with another value, measured in a process of its own."""
    read, write = os.pipe()
    if (child := os.fork()) == 0:
        os.close(read)
        change(number, value)
        with os.fdopen(write, "w") as said:
            json.dump(measure(known), said)
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as said:
        found = said.read()
    os.waitpid(child, 0)
    return {name: tuple(one) for name, one in json.loads(found).items()} if found else {}


def main() -> None:
    """List the numbers; change those of the names given, and print the iterations and verdicts that differ."""
    asked, every = sys.argv[1:], numbers()
    for one in every:
        print(f"{one.module.removeprefix(PACKAGE + '.'):32s} {one.name:24s} {one.value:g}")
    print(f"{len(every)} numbers")
    # numbers of kernels are compiled
    chosen = [one for one in every if one.name in asked and "_kernels" not in one.module]
    if not chosen:
        return
    known = entries()
    usual = measure(known)
    for one in chosen:
        for factor in (0.5, 2.0):
            found = apart(known, one, changed(one.value, factor))
            work = sum(count for _, count in found.values()) / sum(count for _, count in usual.values())
            others = {name: found.get(name, ("failed", 0))[0] for name in usual}
            differ = {name: verdict for name, verdict in others.items() if verdict != usual[name][0]}
            print(
                f"{one.name} {one.value:g} × {factor:g}: {work:.2f} times the iterations; {differ or 'same verdicts'}"
            )


if __name__ == "__main__":
    main()
