"""A study as its samples need it: from a point in standard normal space to the quantities there, and their gradient."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from time import process_time
from typing import Any

import numpy as np

from ground.errors import MomaError
from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly, Strength, assembly, joint_strength
from mechanics.limit.dead_load import at_instant
from mechanics.limit.live_loads import Acceleration
from pipelines.assess.study.gradient import (
    Changed,
    Dual,
    by_density,
    by_strength,
    difference,
    dual,
    together,
)
from pipelines.assess.study.inputs.moved import MovedStones
from pipelines.assess.study.inputs.realise import GEOMETRY, LAW_KEYS, Realised, realise
from pipelines.assess.study.inputs.unknowns import Unknown, Unknowns
from pipelines.assess.study.quantities import Limited, UndecidedError, bound, evaluate, live_load
from pipelines.assess.study.settings import Acts, InputTable, InputType, QuantityTable
from pipelines.assess.workers.store import Sample
from pipelines.run.assemble import Assembly, assemble_stones, closed_stones
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import Groups, StoneModel

_STEP = 1e-4
"""Step of a difference over the standard deviation [-].

Closing is smooth by pieces: in the window bay 1e-2 crosses a kink (4e-4 of the largest derivative by a stone). Rounding
leaves 2e-7 of it at 1e-4, and curvature as much.
"""


@dataclass(frozen=True)
class Problem:
    """A study without its method.

    Attributes
    ----------
    scene, base : as its author wrote it, checked, and as the plain contents of the file
    models, groups : stones of the survey, and the codes that the tables of the scene name
    inputs, quantities : of the study
    unknowns : all of them
    """

    scene: SceneFile
    base: Mapping[str, Any]
    models: tuple[StoneModel, ...]
    groups: Groups
    inputs: tuple[InputTable, ...]
    quantities: tuple[QuantityTable, ...]
    unknowns: Unknowns

    @property
    def dimension(self) -> int:
        """Number of unknowns."""
        return len(self.unknowns)

    @property
    def differentiable(self) -> bool:
        """True where the first quantity has a gradient."""
        return self.quantities[0].type == "bound"

    def sample(self, point: Array, gradient: bool = False) -> Sample:
        """Return the quantities at a point (n,), with the reason where they are not known."""
        begun = process_time()
        try:
            values, slope = self._evaluated(point, gradient and self.differentiable)
        except UndecidedError as error:
            return Sample(point, {}, "undecided", _one_line(error), None, process_time() - begun)
        except MomaError as error:
            return Sample(point, {}, "failed", _one_line(error), None, process_time() - begun)
        return Sample(point, values, "done", "", slope, process_time() - begun)

    def _evaluated(self, point: Array, gradient: bool) -> tuple[dict[str, float], Array | None]:
        values = self.unknowns.values(point)
        realised = self._realised(values)
        assembled = cache(lambda: self._assembled(realised))
        found, limited = evaluate(self.quantities, assembled, realised.models, realised.turn)
        if not gradient or limited is None:
            return found, None
        return found, self.unknowns.gradient(point, self.by_values(values, limited, realised, assembled()))

    def _realised(self, values: Array) -> Realised:
        valued = list(zip(self.unknowns.each, values.tolist(), strict=True))
        return realise(self.scene, self.base, self.models, self.inputs, valued)

    def _assembled(self, realised: Realised) -> Assembly:
        same = not any(table.type in GEOMETRY for table in self.inputs)
        return assemble_stones(realised.scene, realised.models, self.groups, self._shapes if same else None)

    @cached_property
    def _shapes(self) -> Any:
        return closed_stones(self.scene, self.models)

    def by_values(self, values: Array, limited: Limited, realised: Realised, assembled: Assembly) -> Array:
        """Return the derivatives (n,) of the first quantity by the values of all unknowns; zero where it has none.

        Where the contacts of two assemblies cannot be compared, λ itself is.
        """
        derivatives = np.zeros(len(values))
        at = dual(limited)
        if at is None:
            return derivatives
        rest: list[int] = []
        densities = None
        for number, unknown in enumerate(self.unknowns.each):
            kind = self.inputs[unknown.input].type
            if kind is InputType.DENSITY:
                densities = self._by_densities(at) if densities is None else densities
                derivatives[number] = self._by_density(densities, unknown, values[number], assembled)
            elif kind in LAW_KEYS:
                derivatives[number] = self._by_law(at, unknown, values[number])
            elif kind not in (InputType.YOUNG, InputType.RECORD):
                rest.append(number)
        local = [number for number in rest if self.inputs[self.unknowns.each[number].input].type in GEOMETRY]
        if local:
            derivatives[local] = self._by_geometry(at, values, local, realised, assembled)
        for number in set(rest).difference(local):
            derivatives[number] = self._by_load(at, values, number)
        return derivatives

    def _by_densities(self, at: Dual) -> dict[str, float]:
        """Return the derivative by the logarithm of the density of each free stone, by code."""
        limited = at.limited
        on = limited.on
        light = limited.load if isinstance(limited.live, Acceleration) else np.zeros_like(limited.load)
        codes = [on.model.scene.blocks[body].code for body in on.free]
        found: dict[str, float] = dict(zip(codes, by_density(at, light).tolist(), strict=True))
        return found

    def _by_density(
        self, by_code: Mapping[str, float], unknown: Unknown, value: float, assembled: Assembly
    ) -> float:
        """Return the derivative by an unknown of the density: of λ by ln ρ, times that of ln ρ by its value."""
        total = 0.0
        for code in unknown.stones:
            if code not in by_code:
                continue
            if unknown.acts is Acts.FACTOR:
                rate = 1.0 / (1.0 + value if unknown.part == "scatter" else value)
            else:
                rate = 1.0 / self._densities(assembled)[code]
            total += by_code[code] * rate
        return total

    def _densities(self, assembled: Assembly) -> dict[str, float]:
        return {block.code: block.material.density for block in assembled.scene.blocks}

    def _by_law(self, at: Dual, unknown: Unknown, value: float) -> float:
        """Return the derivative by the parameter of laws, from the strength of joints alone."""
        table = self.inputs[unknown.input]
        step = _STEP * max(abs(unknown.distribution.slope(0.0)), 1e-9)
        step = min(step, 0.5 * abs(value)) or step
        on = at.limited.on
        ends = [self._strength(on, table, value, sign * step) for sign in (1.0, -1.0)]
        rate = (2.0 * step) ** -1
        change = Strength(
            rate * (ends[0].friction - ends[1].friction),
            rate * (ends[0].cohesion - ends[1].cohesion),
            rate * (ends[0].tension - ends[1].tension),
        )
        return by_strength(at, change)

    def _strength(self, on: RigidAssembly, table: InputTable, value: float, step: float) -> Strength:
        laws = on.model.laws
        chosen = range(len(laws.laws)) if table.law is None else (table.law,)
        changed = list(laws.laws)
        for index in chosen:
            if index >= len(changed):
                continue
            for key in LAW_KEYS[table.type]:
                old = getattr(changed[index], key, None)
                if old is not None:
                    new = old * (1.0 + step / value) if table.acts is Acts.FACTOR else old + step
                    changed[index] = replace(changed[index], **{key: new})  # type: ignore[type-var]
        return joint_strength(on.model, on.contacts, replace(laws, laws=tuple(changed)))

    def _by_geometry(
        self, at: Dual, values: Array, numbers: Sequence[int], realised: Realised, assembled: Assembly
    ) -> Array:
        """Return the derivatives (k,) by unknowns of geometry."""
        moved = MovedStones(
            self.models,
            self.groups,
            self.inputs,
            list(zip(self.unknowns.each, values.tolist(), strict=True)),
            realised,
            assembled,
        )
        live = at.limited.live

        def changed(moves: Mapping[int, float]) -> Changed:
            """Return the assembly at other values of the inputs."""
            scene = moved.scene({numbers[place]: step for place, step in moves.items()})
            return assembly(at_instant(scene)), live

        each = [self.unknowns.each[number] for number in numbers]
        steps = np.array([_STEP * abs(unknown.distribution.slope(0.0)) for unknown in each])
        reach = moved.reach([unknown.stones for unknown in each], at.limited.on.contacts.bodies)
        found = together(at, reach, steps, changed)
        for place in np.flatnonzero(np.isnan(found)).tolist():
            step = float(steps[place])
            found[place] = self._differenced(changed({place: step}), changed({place: -step}), step)
        return found

    def _by_load(self, at: Dual, values: Array, number: int) -> float:
        """Return the derivative by an unknown of loads or their direction."""
        step = _STEP * abs(self.unknowns.each[number].distribution.slope(0.0))
        ends = []
        for sign in (1.0, -1.0):
            moved = values.copy()
            moved[number] += sign * step
            realised = self._realised(moved)
            live = live_load(self.quantities[0], realised.turn)
            ends.append((assembly(at_instant(self._assembled(realised).scene)), live))
        quick = difference(at, ends[0], ends[1], step)
        return self._differenced(ends[0], ends[1], step) if quick is None else quick

    def _differenced(self, plus: Changed, minus: Changed, step: float) -> float:
        """Return the central difference of λ itself."""
        name = self.quantities[0].load or ""
        return (bound(*plus, name).value - bound(*minus, name).value) / (2.0 * step)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
