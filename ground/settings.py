"""Settings declared once: meaning, unit and bounds beside the type and the default of a dataclass field."""

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple, get_type_hints


class Setting(NamedTuple):
    """Annotation of a field: ``friction: Annotated[float, Setting("Coulomb's coefficient μ.", "-", at_least=0)]``.

    Attributes
    ----------
    doc : meaning, one sentence; the reference of the scene file shows it
    unit : of the value; "-" for a ratio
    above, at_least, below, at_most : bounds of a number
    choices : the numbers or texts allowed; any if empty
    infinite : infinity is a value, which asks for nothing
    """

    doc: str
    unit: str = ""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    choices: tuple[int | str, ...] = ()
    infinite: bool = False


@cache
def declared(owner: type) -> Mapping[str, Setting]:
    """Return the settings that a dataclass declares, by field."""
    hints = get_type_hints(owner, include_extras=True)
    return {
        name: setting
        for name, hint in hints.items()
        for setting in getattr(hint, "__metadata__", ())
        if isinstance(setting, Setting)
    }
