"""Profiles: named sets of settings, from a quick look to accurate stresses, for `moma run --profile`."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from ground.errors import UsageError
from ground.toml.schema import nearest
from ground.units import CENTI, MILLI
from mechanics.scene.scene import Fidelity, Method, Placement, TimeSettings
from mechanics.stones.meshing.elements import Element
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import StoneModel
from pipelines.tuning.overlay import Overlay, overlaid, typical_width


@dataclass(frozen=True)
class Profile:
    """A named set of settings.

    Attributes
    ----------
    name : on the command line
    about : its purpose
    rest : settings of scenes that seek an equilibrium or a collapse: θ = 1, or relaxation
    step, theta : replace those of `rest` where the scene follows the motion itself: θ < 1 without relaxation [s], [-]
    """

    name: str
    about: str
    rest: Overlay
    step: float
    theta: float

    def overlay(self, time: TimeSettings) -> Overlay:
        """Return the changes to a scene with these settings of time."""
        if time.relaxation or time.theta == 1.0:
            return self.rest
        return replace(self.rest, step=self.step, theta=self.theta)


_FAST = Profile(
    "fast",
    "does it stand, and what do its joints bear: all stones rigid, no stress",
    Overlay(
        fidelity=Fidelity.RIGID,
        element=Element.TET10,
        cells=1.0,
        points=4,
        placement=Placement.CORNERS,
        step=0.01,
        theta=1.0,
        method=Method.AUTO,
        tolerance=1e-5,
        # with a looser one, rigid stones in steps of this length miss a balance of 10⁻⁴ and never come to rest
        velocity_tolerance=1e-5,
        motion_error=MILLI,
        max_iterations=2000,
    ),
    step=0.002,
    theta=0.55,
)
_BALANCED = Profile(
    "balanced",
    "stresses of the stones that the scene lets deform, one quadratic element across a typical stone",
    Overlay(
        element=Element.TET10,
        cells=1.0,
        points=4,
        placement=Placement.CORNERS,
        step=0.005,
        theta=1.0,
        method=Method.AUTO,
        tolerance=1e-6,
        velocity_tolerance=1e-4,
        motion_error=CENTI * MILLI,
        max_iterations=3000,
    ),
    step=0.001,
    theta=0.51,
)
_ACCURATE = Profile(
    "accurate",
    "all stones deform, two quadratic elements across a typical stone",
    Overlay(
        fidelity=Fidelity.DEFORMABLE,
        element=Element.TET10,
        cells=2.0,
        points=8,
        placement=Placement.CORNERS,
        step=0.002,
        theta=1.0,
        method=Method.AUTO,
        tolerance=1e-7,
        velocity_tolerance=1e-5,
        motion_error=MILLI * MILLI,
        max_iterations=5000,
    ),
    step=0.0005,
    theta=0.5,
)
PROFILES: Mapping[str, Profile] = MappingProxyType(
    {profile.name: profile for profile in (_FAST, _BALANCED, _ACCURATE)}
)
"""From the quickest to the most accurate."""


def profile_named(name: str) -> Profile:
    """Return the profile of this name.

    Raises
    ------
    UsageError : there is none
    """
    if name not in PROFILES:
        raise UsageError(f"unknown profile {name!r}", where="--profile", remedy=nearest(name, PROFILES))
    return PROFILES[name]


def with_profile(scene: SceneFile, name: str | None, models: Iterable[StoneModel]) -> SceneFile:
    """Return the scene with the settings of a profile in place of its own; without a name, unchanged.

    Its lists of [bodies], its [[meshes]] and everything that defines the task are kept.

    Parameters
    ----------
    scene : as its author wrote it
    name : of the profile
    models : stones of the scene, whose typical smallest width sets the mesh size

    Raises
    ------
    UsageError : there is no such profile
    """
    if name is None:
        return scene
    return overlaid(scene, profile_named(name).overlay(scene.time), typical_width(models))
