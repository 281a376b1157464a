"""Results of structures: what the stones and the joints of a course, an arch or a wall show together.

The name of a function is that of the quantity in `archmodel.quantities` that it computes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from archmodel.quantities import quantities_of
from archmodel.relations.members import StructureMembers
from archmodel.store.run_record import StructureValues
from mechanics.arrays import Ints
from mechanics.results.result import Result


@dataclass(frozen=True)
class Share:
    """The share of a structure in a result.

    Attributes
    ----------
    result : of the whole scene
    stones : numbers of its stones among the bodies
    joints : numbers of the joints of its stones, also with stones of other structures
    """

    result: Result
    stones: Ints
    joints: Ints


COMPUTED: dict[str, Callable[[Share], float]] = {}
"""Functions by the name of their quantity; NaN where a structure has no value."""


def computed(function: Callable[[Share], float]) -> Callable[[Share], float]:
    """Register a function as that of the quantity of its name."""
    COMPUTED[function.__name__] = function
    return function


@computed
def crack_width(share: Share) -> float:
    """Return the largest opening of the joints [m]."""
    return float(share.result.joints.opening[share.joints].max(initial=-np.inf))


def structure_results(result: Result, structures: Sequence[StructureMembers]) -> tuple[StructureValues, ...]:
    """Return the results of those structures that have any, by what the catalogue has for their kinds."""
    numbers = {body.code: number for number, body in enumerate(result.bodies)}
    results = []
    for structure in structures:
        stones = np.array(
            sorted(numbers[code] for code in structure.members if code in numbers), dtype=np.int64
        )
        joints = np.flatnonzero(np.isin(result.joints.bodies, stones).any(axis=1))
        share = Share(result, stones, joints)
        values = {name: float(COMPUTED[name](share)) for name in quantities_of(*structure.kinds)}
        values = {name: value for name, value in values.items() if np.isfinite(value)}
        if values:
            kind = structure.kinds[-1]
            results.append(StructureValues(structure.number, structure.code, kind, structure.members, values))
    return tuple(results)
