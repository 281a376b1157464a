"""Measurements that could be made next, each with the variance that it would take away.

To first order a measurement without error of h·u, u standard normal, takes (g·h)²/(h·h) of the variance g·g of the
quantity with the gradient g. So a core through one header also tells of the rule from which all headers have their
depth, as far as they have it in common.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from pipelines.assess.study.problem import Problem
from pipelines.assess.study.settings import InputType

_JOINTS = {
    InputType.FRICTION: "sliding tests of friction",
    InputType.COHESION: "shear tests of joints",
    InputType.TENSION: "bond tests of joints",
    InputType.STIFFNESS: "compression tests of joints",
}
_WORDS = {
    InputType.DENSITY: "weigh samples of stone",
    InputType.STRENGTH: "crush cores of stone",
    InputType.YOUNG: "load cores of stone",
    InputType.LOAD: "weigh the load",
    InputType.DIRECTION: "state the direction of the load",
    InputType.RECORD: "state the earthquake",
    InputType.STATION: "measure the stations against one another",
}
SLIGHT = 5e-4
"""Share of the variance that is printed as 0.0 %, so that it is worth no line [-]."""


@dataclass(frozen=True)
class Action:
    """Measurement that could be made.

    Attributes
    ----------
    text : in words
    stone : its code; empty where it is of no single stone
    share : of the variance of the first quantity that it would take away, if it had no error [-]
    """

    text: str
    stone: str
    share: float


def actions(problem: Problem, gradient: Array) -> list[Action]:
    """Return what could be measured, by the variance (gradient (n,) in standard normal space) that it takes away."""
    total = float(gradient @ gradient) or 1.0
    found = [
        Action(text, stone, share)
        for text, stone, numbers in _measurable(problem)
        if (share := _taken(problem, gradient, numbers) / total) > 0.0
    ]
    return sorted(found, key=lambda action: (-action.share, action.text))


def _taken(problem: Problem, gradient: Array, observed: Sequence[Sequence[int]]) -> float:
    """Return the variance that observations take away: each the sum of some unknowns' values, without error."""
    rows = []
    for numbers in observed:
        row = np.zeros(len(gradient))
        for number in numbers:
            row += _direction(problem, number)
        rows.append(row)
    directions = np.array(rows).T
    # observations that say the same count once
    basis, size, _ = np.linalg.svd(directions, full_matrices=False)
    basis = basis[:, size > 1e-12 * size.max(initial=0.0)]
    return float(np.sum((basis.T @ gradient) ** 2))


def _direction(problem: Problem, number: int) -> Array:
    """Return the derivative (n,) of an unknown's value by the point, at the mean."""
    by_value = np.zeros(problem.dimension)
    by_value[number] = 1.0
    return problem.unknowns.gradient(np.zeros(problem.dimension), by_value)


def _measurable(problem: Problem) -> Iterator[tuple[str, str, list[list[int]]]]:
    """Yield each measurement in words, its stone, and the unknowns that each of its observations adds up."""
    for number, table in enumerate(problem.inputs):
        own = [place for place, unknown in enumerate(problem.unknowns.each) if unknown.input == number]
        name = f" ({table.name})" if table.name else ""
        if table.type in _JOINTS:
            yield _JOINTS[table.type] + name, "", [own]
        elif table.type is InputType.DEPTH:
            for code, places in _by_stone(problem, own).items():
                yield f"core through {code}: its depth", code, [places]
        elif table.type in (InputType.PLANE, InputType.POINT):
            for code, places in _by_stone(problem, own).items():
                yield f"more points on {code}", code, [[place] for place in places]
        else:
            common = [place for place in own if problem.unknowns.each[place].part != "scatter"]
            if common:
                yield _WORDS[table.type] + name, "", [[place] for place in common]
            scatter = [place for place in own if problem.unknowns.each[place].part == "scatter"]
            for code, places in _by_stone(problem, scatter).items():
                yield f"{_WORDS[table.type]}{name}: {code}", code, [[*common, *places]]


def _by_stone(problem: Problem, places: Sequence[int]) -> dict[str, list[int]]:
    """Return, for each stone, the unknowns that act on it."""
    found: dict[str, list[int]] = {}
    for place in places:
        for code in problem.unknowns.each[place].stones:
            found.setdefault(code, []).append(place)
    return found


def shares_by_input(problem: Problem, squares: Array) -> dict[str, float]:
    """Return the share of each input, from the squares (n,) of the gradient in standard normal space."""
    total = float(squares.sum()) or 1.0
    shares = {table.name or str(table.type): 0.0 for table in problem.inputs}
    for unknown, square in zip(problem.unknowns.each, squares.tolist(), strict=True):
        table = problem.inputs[unknown.input]
        shares[table.name or str(table.type)] += square / total
    return shares


def shares_by_group(problem: Problem, squares: Array) -> dict[str, float]:
    """Return the share of each group of unknowns: what its stones have in common, and the scatter of all together."""
    total = float(squares.sum()) or 1.0
    shares: dict[str, float] = {}
    for unknown, square in zip(problem.unknowns.each, squares.tolist(), strict=True):
        table = problem.inputs[unknown.input]
        name = table.name or str(table.type)
        label = unknown.label if unknown.part == "common" else f"{name}, of each stone"
        shares[label] = shares.get(label, 0.0) + square / total
    return shares


def shares_by_stone(problem: Problem, found: Sequence[Action]) -> Mapping[str, float]:
    """Return the share that the best measurement of each stone would take away."""
    shares = {model.record.code: 0.0 for model in problem.models}
    for action in found:
        if action.stone:
            shares[action.stone] = max(shares[action.stone], action.share)
    return shares
