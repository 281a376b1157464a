"""Run a scene, or a building in stages, from its start to its outcome, with its history and error measures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import Any, Protocol

import numpy as np
from threadpoolctl import ThreadpoolController

from ground.errors import SolverError
from mechanics.carried import Carried, Checkpointing
from mechanics.dynamics.handover import Beginning, Handover, of_run
from mechanics.dynamics.outcome import Outcome, StaticStart
from mechanics.dynamics.progress import Clock, Listener, Progress, SteppedRun, silent
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.dynamics.step import Step
from mechanics.dynamics.verdicts.lasting import disproof
from mechanics.dynamics.verdicts.watch import Watch
from mechanics.dynamics.warm_start import Memory
from mechanics.model.model import Model, build_model
from mechanics.results.log import Log, result_of, stage_result
from mechanics.results.result import BodyResult, Frame, Result
from mechanics.results.stages import StageResult
from mechanics.scene.laws.law import REST
from mechanics.scene.scene import Fidelity, Method, Scene, Start
from mechanics.scene.stages import Stage, check_stages, whole_scene
from mechanics.scene.state import State

_CLAMPED = (
    "its stones came to rest, but ones that do not deform would fall in their place: what holds them is "
    "self-stress, which no load applies"
)
_UNTRIED = "whether stones that do not deform would fall in their place is not known: their run failed"


class Archive(Checkpointing, Protocol):
    """Place where a run is kept while it goes on."""

    def begin(self, bodies: tuple[BodyResult, ...], frames: Sequence[Frame]) -> None:
        """Take the stones at the start, and the frames so far: a list to which the run adds others."""

    def frame(self) -> None:
        """Note that there is a further frame."""


def simulate(
    scene: Scene,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    built: tuple[Model, State] | None = None,
    archive: Archive | None = None,
) -> Result:
    """Run a scene until it rests, has collapsed, or its duration is over.

    Parameters
    ----------
    scene : the scene
    progress : called at every stage and step
    stop : asked after every step; where it says True, the run ends as interrupted
    built : what `build_model` made of the scene, if it is known; None: build it
    archive : keeps checkpoints and frames, and knows from which checkpoint the run goes on; None: nothing is kept

    A block that stands on a fixed one is carried by its own weight:

    >>> import numpy as np
    >>> from mechanics.scene.scene import Block, Fidelity, Scene
    >>> from mechanics.stones.materials import Material
    >>> cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    >>> faces = (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)
    >>> stone = Material("stone", density=2000.0, young=10e9, poisson=0.2)
    >>> ground = Block("ground", cube - [0, 0, 1], faces, stone, Fidelity.FIXED)
    >>> result = simulate(Scene("one block", (ground, Block("block", cube, faces, stone))))
    >>> result.outcome.value, round(result.reaction / (2000.0 * 9.81), 6)
    ('equilibrium', 1.0)

    Raises
    ------
    SceneError, GeometryError, MeshError : if the scene cannot be built
    SolverError : if the motion is no longer finite
    """
    # dense products of stones are small, and those of several threads would not be the same to the last bit
    with ThreadpoolController().limit(limits=1, user_api="blas"):
        clock = Clock()
        if built is None:
            with clock("mesh"):
                built = build_model(scene, lambda done, total: progress(Progress("mesh", done, total)))
        result, _ = _simulate(built[0], of_run(built[1]), clock, progress, stop, archive)
        if not _keeps_strain(built[0], scene):
            return result
        return _confirmed(result, lambda: simulate(_without_strain(scene), _confirming(progress), stop))


def simulate_stages(
    stages: Sequence[Stage],
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    whole: tuple[Model, State] | None = None,
    archive: Archive | None = None,
) -> Result:
    """Build in stages, each run until it rests; return the result of the last, or of the first that does not rest.

    A stage begins at rest where the one before has ended, with its contact forces, internal variables and broken bonds.
    Stones that are new are laid where they are drawn. Where those on which they are laid have moved, mortar fills the
    gap, and what is in the way is cut off. Loads and motions of supports are those of the stage, and begin with it.
    A stage that does not come to equilibrium is the last.

    Parameters
    ----------
    stages : of building, in their order
    progress, stop, archive : as `simulate` takes them
    whole : what `build_model` made of `whole_scene(stages)`, if it is known

    A second block is laid on one that stands:

    >>> from mechanics.scene.shapes import column
    >>> ground, *drums = column(2, diameter=1.0, height=0.5)
    >>> built = simulate_stages([
    ...     Stage("first", Scene("low", (ground, drums[0]))),
    ...     Stage("second", Scene("high", (ground, *drums))),
    ... ])
    >>> [(stage.name, stage.outcome, round(stage.reaction / stage.weight, 6)) for stage in built.stages]
    [('first', 'equilibrium', 1.0), ('second', 'equilibrium', 1.0)]

    Raises
    ------
    SceneError, GeometryError, MeshError, SolverError : as `simulate`
    """
    check_stages(stages)
    with ThreadpoolController().limit(limits=1, user_api="blas"):
        scene = whole_scene(stages)
        if whole is None and any(block.fidelity is Fidelity.DEFORMABLE for block in scene.blocks):
            whole = build_model(scene, lambda done, total: progress(Progress("mesh", done, total)))
        result = _Building(stages, whole, archive).built(progress, stop)
        if whole is None or not _keeps_strain(whole[0], *(stage.scene for stage in stages)):
            return result
        rigid = [replace(stage, scene=_without_strain(stage.scene)) for stage in stages]
        return _confirmed(result, lambda: simulate_stages(rigid, _confirming(progress), stop))


def _keeps_strain(model: Model, *scenes: Scene) -> bool:
    """Return whether stones deform between rigid joints under loads that last, so that strain may hold what falls."""
    steady = all(scene.steady for scene in scenes)
    return bool(model.elastic.any()) and not model.laws.sprung and steady


def _without_strain(scene: Scene) -> Scene:
    """Return the scene with stones that are all rigid, to be run until it rests by the automatic method.

    Strain cannot be forgotten as contact forces can (`mechanics.dynamics.verdicts.lasting.disproof`): what stones press
    against each other on the way to a rest stays. Rigid ones have no other forces than those that their loads bring
    about.
    """
    time = replace(scene.time, start=Start.REST, stop_at_equilibrium=True)
    solver = replace(scene.solver, method=Method.AUTO)
    return replace(scene.rigid, time=time, solver=solver, frame_every=0)


def _confirming(progress: Listener) -> Listener:
    """Return the listener of a run that confirms another."""
    return lambda one: progress(replace(one, stage="confirm", total=None))


def _confirmed(result: Result, run: Callable[[], Result]) -> Result:
    """Return the result of deformable stones, whose rest those of `run`, which do not deform, must share."""
    if not result.outcome.rests:
        return result
    clock = Clock()
    with clock("confirm"):
        try:
            outcome = run().outcome
        except SolverError:
            result = replace(result, cautions=(*result.cautions, _UNTRIED))
            outcome = result.outcome
    if outcome is Outcome.COLLAPSED:
        result = _instead(result, Outcome.UNDECIDED, _CLAMPED)
    elif outcome is Outcome.INTERRUPTED:
        # a rest that is not confirmed is no verdict
        result = _instead(result, outcome, "")
    seconds = result.wall_time.get("confirm", 0.0) + clock.seconds["confirm"]
    return replace(result, wall_time={**result.wall_time, "confirm": seconds})


def _instead(result: Result, outcome: Outcome, reason: str) -> Result:
    """Return the result with another outcome, of its last stage too."""
    stages = result.stages
    if stages:
        stages = (*stages[:-1], replace(stages[-1], outcome=outcome.value, reason=reason))
    return replace(result, outcome=outcome, reason=reason, stages=stages)


def _simulate(
    model: Model,
    begin: Beginning,
    clock: Clock,
    report: Listener,
    stop: Callable[[], bool],
    archive: Archive | None,
) -> tuple[Result, "_Run"]:
    settings = model.scene.time
    earlier = None if archive is None else archive.earlier()
    run = _Run(model, begin, clock)
    if earlier is not None:
        run.restore(earlier)
    else:
        if settings.start == Start.EQUILIBRIUM and begin.memory is None:
            run.begin_in_equilibrium(report)
        with clock("stress"):
            run.log.begin(run.simulation.state)
    if archive is not None:
        log = run.log
        archive.begin(log.observer.bodies(log.frames[0], np.zeros(len(model.mass))), log.frames)
    report(Progress("step", run.steps, run.total))
    stopped = run.go(report, stop, archive, lambda last: run.keep_frame(archive, regular=True))
    run.keep_frame(archive, regular=False)
    return run.result(Outcome.INTERRUPTED if stopped else run.outcome), run


class _Run(SteppedRun):
    """A run in progress: the simulation, and what is known of its steps so far."""

    CARRIED = ("bed", "log", "static", "steps", "watch")
    REBUILT = ("_begin", "_last", "clock", "outcome", "simulation", "total")

    def __init__(self, model: Model, begin: Beginning, clock: Clock) -> None:
        self._begin = begin
        self.clock, self.steps, self.total, self.bed = clock, 0, model.scene.time.steps, 0.0
        self.static: StaticStart | None = None
        self.simulation = Simulation(model, begin, clock)
        self.log, self.watch = Log(model, begin.drawn, begin.state), Watch(model, begin.state)
        self.outcome = Outcome.MOVING
        self._last: Step | None = None

    @property
    def done(self) -> bool:
        """True where its time is over, it rests or has fallen, or no step can be solved."""
        stops = self._stops_at_rest and self.outcome is not Outcome.MOVING
        return stops or self.watch.hopeless or self.steps >= self.total

    @property
    def text(self) -> str:
        """Imbalance and residual of the last step."""
        return f"balance {self.log.balance.max():.1e}, η {self._made.solution.natural_map:.1e}"

    @property
    def _stops_at_rest(self) -> bool:
        return self.simulation.model.scene.time.stop_at_equilibrium

    @property
    def _made(self) -> Step:
        """Last step."""
        assert self._last is not None, "a run has at least one step, and a checkpoint one left to make"
        return self._last

    def step(self) -> Step:
        """Make one time step; a rest at which the run may end is tried with its forces forgotten."""
        self.steps += 1
        self._last = step = self.simulation.step()
        if self.steps == 1:
            self.bed = _thickest(step, self._begin)
        with self.clock("observe"):
            self.outcome = self.watch(step, self.log(step))
        if self.outcome.rests and (self._stops_at_rest or self.steps == self.total):
            self._try_rest()
        return step

    def _try_rest(self) -> None:
        """Go on moving where the rest does not last once its forces are forgotten."""
        with self.clock("confirm"):
            disproved, surely = disproof(self.simulation)
        if disproved is None:
            return
        simulation = self.simulation
        self.outcome = self.watch.disproved(self.outcome, simulation.state, surely)
        if self.outcome is Outcome.MOVING:
            if simulation.model.scene.time.relaxation:
                self.log.energy.halted(simulation.state)
            self.simulation = disproved

    def keep_frame(self, archive: Archive | None, regular: bool) -> None:
        """Keep a frame of the last step if it is a regular one, or if it is not, as asked."""
        every = self.simulation.model.scene.frame_every
        if regular is not (bool(every) and self.steps % every == 0):
            return
        with self.clock("stress"):
            self.log.frames.append(self.log.observer.frame(self._made))
            if archive is not None:
                archive.frame()

    def result(self, outcome: Outcome) -> Result:
        """Return the result of the run, as of the last step."""
        watch = self.watch
        verdict = watch.verdict(outcome, self.static)
        return result_of(self.log, self._made, verdict, watch.rest_time, self.clock, self.static)

    def begin_in_equilibrium(self, report: Listener) -> None:
        """Begin where all stones bear the loads of the first instant, if there is such a state."""
        simulation = self.simulation
        report(Progress("static", 0, None, "searching for the static equilibrium"))
        with self.clock("start"):
            self.static, search = static_start(simulation.model, simulation.start, report)
        if self.static.found:
            simulation.take_over(search)
            self.log = Log(simulation.model, simulation.start, simulation.state)

    def carried(self) -> dict[str, Any]:
        """Return what a resumed run must know."""
        return super().carried() | {"simulation": self.simulation.carried()}

    def restore(self, carried: Carried) -> None:
        """Go on where another run of the same scene stood."""
        super().restore(carried)
        self.simulation = self.simulation.resumed(carried["simulation"])


def _thickest(step: Step, begin: Beginning) -> float:
    """Return the bed between standing and new stones that differs most from the drawing [m]."""
    bodies = step.contacts.bodies
    joined = begin.standing[bodies[:, 0]] != begin.standing[bodies[:, 1]]
    beds = step.internal[joined, REST]
    return float(beds[np.abs(beds).argmax()]) if len(beds) else 0.0


@dataclass
class _Building:
    """A building in stages, as far as it is built.

    Attributes
    ----------
    stages, whole : as `simulate_stages` takes them
    archive : of the run; None: nothing is kept
    ends : of the stages so far
    seconds : wall seconds by stage of the work
    """

    stages: Sequence[Stage]
    whole: tuple[Model, State] | None
    archive: Archive | None
    ends: tuple[StageResult, ...] = ()
    before: Handover | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    def built(self, report: Listener, stop: Callable[[], bool]) -> Result:
        """Build on, until a stage does not come to rest."""
        earlier = self._resumed()
        for number in range(len(self.ends), len(self.stages)):
            result = self._stage(number, report, stop, earlier)
            earlier = None
            if not result.outcome.rests:
                break
        return replace(result, stages=self.ends, cautions=self._cautions(), wall_time=self.seconds)

    def _stage(
        self, number: int, report: Listener, stop: Callable[[], bool], earlier: Carried | None
    ) -> Result:
        stage, clock = self.stages[number], Clock()
        report(Progress("blocks", 0, None, f"stage {number + 1} of {len(self.stages)}: {stage.name}"))
        with clock("mesh"):
            model, drawn = build_model(stage.scene, meshed=self.whole)
        begin = of_run(drawn) if self.before is None else self.before.to(model, drawn)
        archive = None if self.archive is None else _StageArchive(self.archive, self, number, earlier)
        result, run = _simulate(model, begin, clock, report, stop, archive)
        codes = {block.code for block in stage.scene.blocks}
        stood = set() if self.before is None else {block.code for block in self.before.model.scene.blocks}
        end = stage_result(
            result, stage.name, len(codes - stood), len(stood - codes), self._held(stage), run.bed
        )
        self.ends = (*self.ends, end)
        for work, seconds in result.wall_time.items():
            self.seconds[work] = self.seconds.get(work, 0.0) + seconds
        self.before = run.simulation.handed_over()
        return result

    def _held(self, stage: Stage) -> int:
        """Return the number of stones that are fixed in a stage and free in another."""
        return sum(
            block.fidelity is Fidelity.FIXED and block.code in self._free for block in stage.scene.blocks
        )

    @cached_property
    def _free(self) -> set[str]:
        """Codes of the stones that are free in some stage."""
        blocks = chain.from_iterable(stage.scene.blocks for stage in self.stages)
        return {block.code for block in blocks if block.fidelity is not Fidelity.FIXED}

    def _cautions(self) -> tuple[str, ...]:
        """Return the cautions of the last stage, after what it has left unbuilt; then those of the others."""
        count, last = len(self.stages), self.ends[-1]
        left = count - len(self.ends)
        why = "was interrupted" if last.outcome == Outcome.INTERRUPTED else "did not come to rest"
        unbuilt = (f"{left} of {count} stages were not built, as stage {last.name!r} {why}",)
        earlier = (
            f"in stage {end.name!r}, {caution}"
            for end in self.ends[:-1]
            for caution in filter(None, (end.reason, *end.cautions))
        )
        return (*(unbuilt if left else ()), *last.cautions, *earlier)

    def carried(self) -> dict[str, Any]:
        """Return what the next stage must know of those before."""
        carried = {"ends": self.ends, "seconds": dict(self.seconds)}
        if self.before is None:
            return carried
        return carried | {"state": self.before.state, "memory": self.before.memory.carried()}

    def _resumed(self) -> Carried | None:
        """Go on where another run of the same stages stood; return what its stage carried, None if it had not begun."""
        archived = None if self.archive is None else self.archive.earlier()
        if archived is None:
            return None
        self.ends, self.seconds = tuple(archived["ends"]), dict(archived["seconds"])
        number = len(self.ends)
        if number:
            model, drawn = build_model(self.stages[number - 1].scene, meshed=self.whole)
            memory = Memory()
            memory.restore(archived["memory"])
            self.before = Handover(model, drawn, archived["state"], memory)
        carried: Carried | None = archived.get(f"run {number}")
        return carried


class _StageArchive:
    """Archive of one stage, within that of the whole building; frames are kept of the last stage.

    Parameters
    ----------
    archive : of the building
    building : the stages before
    number : of the stage, from 0
    run : what the run of the stage carried when it was stopped; None: it begins
    """

    def __init__(self, archive: Archive, building: _Building, number: int, run: Carried | None) -> None:
        self._archive, self._before, self._number, self._run = archive, building.carried(), number, run
        self._shown = number == len(building.stages) - 1
        longest = max(stage.scene.time.steps for stage in building.stages)
        every = max(archive.every, 1)
        # checkpoints are known by their step: those of a stage come after those of the one before
        self._offset = number * every * -(-longest // every)
        if number and archive.every and run is None:
            archive.checkpoint(self._offset, self._before)

    @property
    def every(self) -> int:
        """Number of steps between two checkpoints."""
        return self._archive.every

    def earlier(self) -> Carried | None:
        """Return what the stage carried."""
        return self._run

    def checkpoint(self, step: int, carried: Carried) -> None:
        """Keep what the stage carries, beside the stages before."""
        # lists that grow have names of their own in each stage
        self._archive.checkpoint(self._offset + step, self._before | {f"run {self._number}": carried})

    def begin(self, bodies: tuple[BodyResult, ...], frames: Sequence[Frame]) -> None:
        """Take the stones of the last stage."""
        if self._shown:
            self._archive.begin(bodies, frames)

    def frame(self) -> None:
        """Note that there is a further frame of the last stage."""
        if self._shown:
            self._archive.frame()
