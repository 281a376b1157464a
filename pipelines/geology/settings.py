"""Settings of a geological scene, table by table."""

from dataclasses import dataclass
from typing import Annotated

from ground.errors import SceneError
from ground.settings import Setting
from ground.units import GRAVITY

FRICTION = 0.4
"""Usual friction between disks [-]."""


@dataclass(frozen=True)
class SampleSettings:
    """`[sample]`: the disks, and how they are prepared."""

    smallest: Annotated[float, Setting("Smallest radius.", "m", above=0)]
    largest: Annotated[float, Setting("Largest radius.", "m", above=0)]
    density: Annotated[float, Setting("Of the disks.", "kg/m³", above=0)] = 2800.0
    large_share: Annotated[
        float | None,
        Setting(
            "Part of the disks that have the largest radius, the others the smallest; without it, evenly distributed.",
            "-",
            at_least=0,
            at_most=1,
        ),
    ] = None
    falling_friction: Annotated[
        float,
        Setting(
            "Friction while disks are deposited; less makes the sample denser.", "-", at_least=0, at_most=10
        ),
    ] = FRICTION
    seed: Annotated[int, Setting("Of sizes and places; another seed is another sample.", at_least=0)] = 1
    layers: Annotated[
        int, Setting("Marker layers of pictures and measures, of equal heights.", at_least=1, at_most=50)
    ] = 6
    layer_tops: Annotated[
        tuple[float, ...],
        Setting(
            "Heights up to which marker layers reach, from below, instead; what lies above is one more.", "m"
        ),
    ] = ()

    def __post_init__(self) -> None:
        if self.largest < self.smallest:
            raise SceneError(
                f"largest = {self.largest:g} is less than smallest = {self.smallest:g}",
                where="sample",
                remedy="exchange them",
            )
        if any(
            upper <= lower for lower, upper in zip((0.0, *self.layer_tops), self.layer_tops, strict=False)
        ):
            raise SceneError(
                f"layer_tops = {list(self.layer_tops)} do not grow from 0",
                where="sample",
                remedy="give the heights from below",
            )


@dataclass(frozen=True)
class DiskContact:
    """`[contact]`: the laws of the contacts."""

    friction: Annotated[float, Setting("Between disks.", "-", at_least=0, at_most=10)] = FRICTION
    wall_friction: Annotated[
        float | None,
        Setting("Between disks and walls; without it, that between disks.", "-", at_least=0, at_most=10),
    ] = None
    rolling: Annotated[
        bool, Setting("Disks turn; false: their rotation is blocked, as by a strong resistance to rolling.")
    ] = True
    cohesion: Annotated[float, Setting("Pull γ of each contact between disks; 0: none.", "N", at_least=0)] = (
        0.0
    )
    cohesion_range: Annotated[
        float, Setting("Gap within which it acts, over the smallest radius.", "-", above=0, at_most=1)
    ] = 0.05


@dataclass(frozen=True)
class Layer:
    """`[[layers]]`: a material, up to a height; disks are of the layer in which their centres lie at the start.

    What is left out is that of `[sample]` and `[contact]`. Between two layers the smaller friction and cohesion hold.
    """

    top: Annotated[
        float,
        Setting("Height up to which it reaches; the last layer reaches up to the surface.", "m", above=0),
    ]
    density: Annotated[float | None, Setting("Of its disks.", "kg/m³", above=0)] = None
    friction: Annotated[float | None, Setting("Between its disks.", "-", at_least=0, at_most=10)] = None
    cohesion: Annotated[
        float | None, Setting("Pull γ of each contact between its disks.", "N", at_least=0)
    ] = None


@dataclass(frozen=True)
class Stepping:
    """`[time]`: steps of the run."""

    step: Annotated[float, Setting("Time step h.", "s", above=0)]
    steps: Annotated[int, Setting("Number of steps.", at_least=1)]
    theta: Annotated[float, Setting("Integration parameter θ.", "-", at_least=0.5, at_most=1)] = 1.0
    gravity: Annotated[float, Setting("Downwards; the sample settles under it.", "m/s²", above=0)] = GRAVITY


@dataclass(frozen=True)
class Sweeping:
    """`[solver]`: sweeps of each step."""

    min_iterations: Annotated[int, Setting("Sweeps of each step, at least.", at_least=0)] = 100
    max_iterations: Annotated[int, Setting("Sweeps of each step, at most.", at_least=1)] = 100
    tolerance: Annotated[float, Setting("η at which a step counts as solved.", "-", above=0, below=1)] = 1e-4
    largest_overlap: Annotated[
        float, Setting("Overlap over the smallest radius that no step leaves.", "-", above=0)
    ] = 0.01
    threads: Annotated[int, Setting("Threads that sweep; the results have the same bits.", at_least=1)] = 1

    def __post_init__(self) -> None:
        if self.max_iterations < self.min_iterations:
            raise SceneError(
                f"max_iterations = {self.max_iterations} is less than min_iterations = {self.min_iterations}",
                where="solver",
                remedy="give as many or more",
            )


@dataclass(frozen=True)
class GeologyOutput:
    """`[output]`: what is kept, and how often."""

    every: Annotated[int, Setting("Steps between two rows of the measures.", at_least=1)] = 20
    fields_every: Annotated[int, Setting("Steps between two instants of all disks.", at_least=1)] = 500
    checkpoint: Annotated[int, Setting("Steps between two checkpoints; 0: none.", at_least=0)] = 200
    figures: Annotated[bool, Setting("Draw the figures.")] = True
    figures_at: Annotated[
        tuple[float, ...],
        Setting(
            "Instants of which figures are drawn, and all disks kept, besides the last; 0: the start.", "s"
        ),
    ] = ()

    def __post_init__(self) -> None:
        if any(not time >= 0.0 for time in self.figures_at):
            raise SceneError(
                f"figures_at = {list(self.figures_at)}",
                where="output",
                remedy="give times from 0 on, in seconds",
            )
