"""Table [pushover] of a scene: the rig, the displacements to which it pushes, and the scatter of what decides."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from ground.settings import Setting
from ground.toml.keys import Numbers, Vector, keys_of, typed_values
from ground.toml.schema import Key, TomlDocument, ValueKind, check_table
from mechanics.scene.rig import Rig


@dataclass(frozen=True, kw_only=True)
class _Direction:
    """Direction of the push."""

    direction: Annotated[
        Vector, Setting("Horizontal direction of the push; its length does not matter.", "-")
    ] = (1.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Pushing:
    """Test that [pushover] asks for.

    Attributes
    ----------
    rig : where it pushes
    scatter : coefficients of variation by the names of `SCATTER`, of those that are given [-]
    """

    rig: Rig
    scatter: Mapping[str, float]
    to: Annotated[
        Numbers,
        Setting(
            "Displacements of the push, in turn: one, or those of cycles, such as [0.01, -0.01, 0.02, -0.02].",
            "m",
        ),
    ]
    step: Annotated[
        float | None,
        Setting(
            "Way of one step; if not given, 1/200 of the largest displacement, or half of the least 2 G/c of "
            "bonds that soften, where that is less.",
            "m",
            above=0,
        ),
    ] = None
    measured: Annotated[
        str | None,
        Setting("CSV file beside the scene, to be drawn beside the curve: displacement [mm], force [kN]."),
    ] = None
    level: Annotated[float, Setting("Level of the band of `[pushover.scatter]`.", "-", above=0, below=1)] = (
        0.9
    )


PUSHOVER_KEYS = (*keys_of(_Direction), *keys_of(Rig), *keys_of(Pushing))
"""Keys of [pushover]."""

SCATTER: Mapping[str, str] = {
    "friction": "friction of all joints",
    "stiffness": "stiffness of all elastic joints, or the modulus of their mortar",
    "tension": "tensile strength of the joints, with its energy",
    "shear": "shear strength of the joints, with its energy",
    "compressive_strength": "pressure at which joints crush",
    "load": "vertical force",
    "density": "density of the stones",
}
"""What may scatter."""

SCATTER_KEYS = tuple(
    Key(name, ValueKind.NUMBER, f"Coefficient of variation of the {what}.", "-", None, above=0, below=1)
    for name, what in SCATTER.items()
)
"""Keys of [pushover.scatter]."""


def read_pushover(document: TomlDocument, toml: Mapping[str, Any]) -> Pushing | None:
    """Check the table; None where a scene has none."""
    if "pushover" not in toml:
        return None
    content = toml["pushover"]
    if not isinstance(content, dict):
        document.fail("'pushover' is not a table", "pushover", remedy="write [pushover] on a line of its own")
    plain = {key: value for key, value in content.items() if key != "scatter"}
    values: dict[str, Any] = check_table(document, ("pushover",), plain, PUSHOVER_KEYS)
    scatter: dict[str, Any] = check_table(
        document, ("pushover", "scatter"), content.get("scatter", {}), SCATTER_KEYS
    )
    with document.at("pushover"):
        rig = Rig(direction=values["direction"], **typed_values(Rig, values))
    if not values["to"] or not any(values["to"]):
        document.fail("no displacement", "pushover", "to", remedy="give at least one, such as [0.03]")
    given_scatter = {name: value for name, value in scatter.items() if value is not None}
    return Pushing(rig=rig, scatter=given_scatter, **typed_values(Pushing, values))
