"""State that one step of a run hands to the next, as plain values that a checkpoint can hold."""

from collections.abc import Mapping
from typing import Any, ClassVar, Protocol, TypeVar

T = TypeVar("T")

Carried = Mapping[str, Any]
"""State by the names of attributes: numbers, texts, arrays, records and tuples of these, `Rows`, further mappings."""


class Checkpointing(Protocol):
    """Place where the checkpoints of a run are kept."""

    @property
    def every(self) -> int:
        """Number of steps between two checkpoints; 0: only where the run is stopped."""

    def earlier(self) -> Carried | None:
        """Return the last checkpoint of the same scene, from which the run is to go on; None: from the start."""

    def checkpoint(self, step: int, carried: Carried) -> None:
        """Take what the run carries after a step; nothing of it may be kept without a copy."""


class Rows(list[T]):
    """Append-only list; a checkpoint writes only the rows that are new."""


class Carrier:
    """Object that changes from step to step, and whose changes a checkpoint keeps.

    Each attribute of an object has its name in one of two tuples of the class. A resumed run makes the object afresh
    and restores what is carried; it then takes the same steps, to the last bit.

    Attributes
    ----------
    CARRIED : attributes that change: plain values, or carriers themselves
    REBUILT : attributes that the constructor makes again, or that `restore` makes of those carried, and memories that
        save time but never change a bit
    """

    CARRIED: ClassVar[tuple[str, ...]] = ()
    REBUILT: ClassVar[tuple[str, ...]] = ()

    def carried(self) -> dict[str, Any]:
        """Return the values of all carried attributes; arrays are shared, not copied."""
        return {name: _plain(getattr(self, name)) for name in self.CARRIED}

    def restore(self, carried: Carried) -> None:
        """Take over the values of another run of the same scene; arrays are taken over, not copied."""
        for name in self.CARRIED:
            value = getattr(self, name)
            if isinstance(value, Carrier):
                value.restore(carried[name])
            else:
                setattr(self, name, carried[name])


def _plain(value: Any) -> Any:
    return value.carried() if isinstance(value, Carrier) else value
