"""Assemblies of other programs, taken in from their files of solids as a user would.

Stones whose curved joints would take more than 32 convex parts are refused, and stones with folded faces: `REFUSED`,
and cra-curve-3-blocks, which takes nine minutes until then.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from mechanics.scene.scene import Fidelity, Scene
from pipelines.ingest.ingest import ingest
from pipelines.ingest.reading_options import reading_options, solid_options
from tests.paths import ROOT
from tests.pipelines.scenes import assembled

ASSEMBLIES = ROOT.parent / "shared/data/assemblies"
_SCENE = """
[scene]
name = "{name}"
[materials.stone]
density = 2000.0
young = 12e9
poisson = 0.2
[bodies]
default = "rigid"
[joints]
mode = "as-surveyed"
[contact]
friction = {friction}
[time]
step = 0.005
duration = 1.0
"""


@dataclass(frozen=True)
class Model:
    """Assembly of a file of solids.

    Attributes
    ----------
    friction : of all joints [-]
    snap : distance within which corners and faces are drawn together [m]
    foot : height over that of the whole below which stones reach that stay [-]
    above : over the lost load, from which runs fall [-]
    """

    friction: float = 0.84
    snap: float | None = None
    foot: float = 1e-3
    above: float = 1.005


REFUSED = {
    "cra-snake": (Model(snap=1e-5), "more than 32 convex parts"),
    "armadillo": (Model(snap=0.003, foot=0.01), "not quite planar"),
}
"""Models that are no solids with flat faces, and what is said of them."""

MODELS: Mapping[str, Model] = {
    "wall": Model(snap=0.003),
    "cra-bridge": Model(snap=1e-5),
    "cra-shelf": Model(snap=1e-5),
    "acary-arches": Model(above=1.04),
    "dome": Model(snap=0.003, above=1.04),
    "crossvault": Model(snap=0.003),
    "buttresses": Model(0.6),
    "pavillion": Model(0.7, above=1.2),
}


def model(name: str, folder: Path) -> Scene:
    """Return the scene of an assembly, by way of a database in a folder."""
    entry, url = MODELS.get(name) or REFUSED[name][0], f"sqlite:///{folder / name}.db"
    ingest(
        [ASSEMBLIES / f"{name}.obj"],
        url,
        "solids",
        options=solid_options(reading_options(unit="m"), snap=entry.snap),
    )
    scene = assembled(url, _SCENE.format(name=name, friction=entry.friction)).scene
    heights = [(block.vertices[:, 2].min(), block.vertices[:, 2].max()) for block in scene.blocks]
    foot, top = min(low for low, _ in heights), max(high for _, high in heights)
    blocks = tuple(
        replace(block, fidelity=Fidelity.FIXED) if low <= foot + entry.foot * (top - foot) else block
        for block, (low, _) in zip(scene.blocks, heights, strict=True)
    )
    return replace(scene, blocks=blocks)
