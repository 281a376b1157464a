"""Strategy for rigid scenes: sweeps, ADMM, Newton's method, the interior point; each is fast where another is slow."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import project_on_cone, residual
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.proximal_newton import ProximalNewton
from mechanics.solvers.second_order.scaling import solved_evenly

__all__ = ["FROM_NOTHING", "TURNS", "Alternating", "many_bodies", "moving_admm", "some_bodies"]

# sweeps with which every solution but the first begins: near a solution they suffice
_FIRST_SWEEPS = 20
# sweeps between two extrapolations
_LOOK = 5
# iterates from which is extrapolated
_DEPTH = 10
# penalty of ADMM over the scale of W for stones that stay in touch: it finds their forces within a dozen iterations, or
# never [-]
_STATIC_PENALTY = 1e-4
# iterations of that ADMM
_STATIC_ITERATIONS = 40
# fall of η over two looks below which that ADMM gives up [-]
_STATIC_PATIENCE = 3.0
# iterations between two looks of that ADMM
_STATIC_LOOK = 5
# tolerances over those asked for: going further costs little and spares the next steps any work [-]
_FURTHER = 0.03
# steps within which Newton's method has converged, or wanders: between rigid stones most often where much slides
_NEWTON_STEPS = 20
# Newton's steps from where the interior point stood: with many contacts at the edge between stick and slip, as in a
# leaning column that slides as one, η is small long before the light stones between heavy ones follow
_ENDING_STEPS = 60
# α over the scale of W by which self-stress is told from forces that bodies feel, and corrections: of masses that
# differ by 10⁶, forces are then exact to 10⁻⁵ and self-stress to 10⁻⁶
_RELEASE, _RELEASES = 1e-9, 4
# penalty of ADMM over the scale of W where contacts open and slide; it is balanced then [-]
_MOVING_PENALTY = 0.03
# iterations for which that ADMM holds its shift
_MOVING_HOLD = 10
# iterations of that ADMM, which cost as much as the interior point
_MOVING_ITERATIONS = 400
# iterations of the interior point
_INTERIOR = 60
# penalty of ADMM over the scale of W from where the interior point stood, right for what still moves [-]
_LAST_PENALTY = 0.3
# iterations of that ADMM
_LAST_ITERATIONS = 300

# share of all iterations after which Newton's method and ADMM, in turns, leave a step of a motion to other methods:
# between warped stones that fall they may wander for ever where the interior point needs a few hundred [-]
_TRIED = 0.5
# Newton's steps in which it follows forces that grow until a contact slips, and the iterations after them
_FOLLOWING = 100
_SORTING = (Stage(0.2, 100, extrapolated=True),)
# steps without any slip after which methods for rest are tried again; where they fail, they cost as much as one step
_MOTION = 20
# tolerances over those asked for to which the steps of a motion go as long as that is cheap [-]
_MOTION_FURTHER = 0.1
# velocity of a contact that slides, over the one up to which contacts may break their laws [-]
_SLIDES = 10.0
# and over the fastest u_free, at most [-]
_SLOW = 1e-2
# loosest tolerances of a motion: beyond, contacts no longer obey their laws [-]
_LOOSEST, _LOOSEST_MAP = 0.025, 1e-2
# velocity tolerance from which a step begins where the last one ended, with extrapolations at once [-]
_LOOSE = 1e-3
# measures of the residual over their tolerances, up to which forces of the last step are balanced again [-]
_NEAR = 30.0
_BALANCING = (Stage(1e-3, 20, extrapolated=True),)
# velocities over the tolerance that stones at rest may have, before their forces are balanced again [-]
_CALM = 0.01
# part of the tolerance on velocities up to which a gap counts as closed then: by less than an ångström, as a rule [-]
_CLOSED = 0.9
# tolerances over those asked for to which they are balanced: the rest of the run may well be a thousand steps [-]
_EXACT = 1e-6
# iterations from where ADMM with a small penalty stood, as it nearly always is close when it gives up
_ENDING = (Stage(1e-3, 60, extrapolated=True),)
# bodies from which a cold start asks ADMM and the interior point before Newton's method: where a tenth of 10⁴ contacts
# slides or opens, this seldom finds them within its steps, of which each takes as long as an iteration of that. Later
# steps ask ADMM before joints may yield
_SOME = 300
# bodies from which Newton's steps in a motion, which factorise anew each, cost more than iterations with kept factors
_MANY = 1000
# their penalties in turn: with the large one contacts sort themselves out. Then forces change steadily, by so much in
# each iteration, until a contact opens or slips: with a small one of the contacts that stick they arrive 200 times as
# soon, while those that are open or slide have larger ones, and do not swing
_SORTED = Stage(1.0, 40, extrapolated=False)
_DRIFTED = Stage((1.0, 0.05, 0.005), 60, extrapolated=False)
# most steps end in the first turn, which is gentler and has more time to sort itself out
TURNS = (
    replace(_SORTED, iterations=10),
    replace(_DRIFTED, penalty=(1.0, 0.05, 0.01)),
    replace(_SORTED, iterations=80),
    *(50 * (_DRIFTED, _SORTED)),
)
# iterations of them where joints may yield instead
_TURNS_ITERATIONS = 400
# of few bodies: most walls need one penalty, in some 40 iterations; what wedges needs the turns
_LOOSE_STAGES = (Stage(0.1, 80, extrapolated=True), *TURNS)
# the same where errors may be many times those of the loosest tolerances: by how many, and σ, with which contacts that
# stick arrive less exactly but sooner; nothing is extrapolated, which costs two thirds of an iteration, and pays late
_ROUGH = tuple(
    (times, (Stage(penalty, 80, extrapolated=False), *TURNS)) for times, penalty in ((4.0, 0.2), (2.0, 0.1))
)
# those with which forces of rest are found from nothing in irregular joints: once it is known what opens and slides, a
# thousandth of the first penalty suffices where contacts stick, so that their forces arrive in some 50 iterations
FROM_NOTHING = (
    TURNS[0],
    replace(TURNS[1], iterations=30),
    Stage((1.0, 0.01, 1e-3), 150, extrapolated=True),
)
# and what finds them at once where all contacts stick
_STICKING = Stage(1e-3, 50, extrapolated=True, longer=100)
# tolerances to which it does, over those asked for: a motion at rest keeps these forces for hundreds of steps [-]
_STICKING_FURTHER = 1e-4
# stages that solve steps in which next to nothing moves
_RESTING = ("sweeps", "admm, small penalty")

_Solver = Callable[[ContactProblem, ContactStart], ContactSolution]


def moving_admm(tolerance: float, velocity_tolerance: float, max_iterations: int) -> ADMM:
    """Return ADMM for rigid bodies of which many slide or open."""
    return ADMM(
        tolerance, velocity_tolerance, max_iterations, _MOVING_PENALTY, hold=_MOVING_HOLD, balanced=True
    )


@dataclass(frozen=True)
class Alternating:
    """Methods in turn until one has solved the problem; the best result counts.

    Gauss–Seidel propagates information one stone per sweep, so it comes first only where the forces of the last step
    are known. ADMM with a small penalty solves the motion of all stones at once, and needs a dozen iterations as long
    as few contacts open or slide. Newton's method finds the contacts that do by a few factorisations. From a cold start
    of 300 bodies and more ADMM on their velocities comes next, and then, or at once of fewer, the interior point, which
    converges whatever the height, the masses and the redundancy; in a motion, ADMM
    with a balanced penalty first. Methods that factorise work in units in which all contacts yield alike
    (`equilibrated`). docs/design/solvers.md has measurements.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : sweeps and iterations together
    thorough : try also methods that take far longer than the others, and seldom help where these do not
    motion_speed : velocity by which contacts may break their laws in the steps of a motion [m/s]; None: as in others
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    thorough: bool = True
    motion_speed: float | None = None

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; `why` names the method that solved it, and what the one before left."""
        best = ContactSolution(start.impulse, start.velocity, 0, np.inf, False, "nothing: no contacts")
        if len(start.impulse) == 0:
            return replace(best, natural_map=0.0, converged=True)
        warm = bool(start.impulse.any())
        before = "warm start" if warm else f"cold start, {len(start.impulse):,} contacts"
        follows = warm and start.motion is not None and problem.delassus.rigid is not None
        if warm and not (follows and start.motion):
            kept = self._kept(problem, start, follows)
            if kept is not None:
                return kept
        motion = start.motion is not None
        many = motion and many_bodies(problem)
        rests = ("sweeps",) if many else _RESTING
        moved = False
        for name, solve, from_best in self._stages(problem, warm, motion, many):
            if follows and not moved and (start.motion or name not in rests):
                found, moved = self._in_motion(problem)._moved(problem, start), True
                before = f"admm of bodies stood at η {found.natural_map:.0e}"
                best = _better(best, found)
                if best.converged or best.iterations >= self.max_iterations:
                    break
                start = ContactStart(best.impulse, best.velocity, start.motion)
            count = self.max_iterations - best.iterations
            begin = ContactStart(best.impulse, best.velocity) if from_best else start
            found = self._judged(problem, solve(count)(problem, begin), f"{name}: {before}")
            before = f"{name} stood at η {found.natural_map:.0e}"
            best = _better(best, replace(found, motion=_MOTION if moved else 0))
            # the stages after sweeps ask for W in a form that can be factorised, which takes as long as a sweep
            if best.converged or best.iterations >= self.max_iterations:
                break
        return best

    def _kept(self, problem: ContactProblem, start: ContactStart, follows: bool) -> ContactSolution | None:
        """Return the forces of the last step if they are a solution still, or balanced again where nothing moves.

        Forces that balance up to a tolerance, kept from step to step, push stones a little in each, until gaps of an
        ångström fill the tolerance. A few iterations on the velocities of the bodies balance them far better than
        sweeps, so that the next steps find them balanced. No forces are sought where any contact moves: they might hold
        stones that nothing carries.
        """
        limits = self.tolerance, self.velocity_tolerance
        left, calm = residual(problem, start.impulse), _CALM * self.velocity_tolerance
        kept = None
        if left.within(*limits):
            impulse = start.impulse.copy()
            kept = ContactSolution(impulse, left.dual, 0, left.natural_map, True, "sweeps: warm start")
            if left.velocity <= calm:
                return kept
        if not (follows and left.within(_NEAR * limits[0], _NEAR * limits[1])):
            return kept
        small = _CLOSED * self.velocity_tolerance * float(np.abs(problem.u_free).max())
        closed = replace(problem, bias=np.where(np.abs(problem.bias) <= small, 0.0, problem.bias))
        if kept is not None and residual(closed, start.impulse).velocity <= calm:
            return kept
        if not self._rests(problem, start.impulse):
            return kept
        solver = BodyADMM(_EXACT * limits[0], _EXACT * limits[1], self.max_iterations, _BALANCING)
        found = solver(closed, ContactStart(start.impulse, np.zeros_like(start.velocity)))
        balanced = residual(problem, found.impulse)
        if not balanced.within(*limits):
            return kept
        why = f"admm of bodies: forces of the last step left velocities of {left.velocity:.0e}"
        return ContactSolution(
            found.impulse, balanced.dual, found.iterations, balanced.natural_map, True, why
        )

    def _moved(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve a step of a motion, from where the last two lead.

        Rigid faces that close on each other under friction hold some contacts to velocities that differ by next to
        nothing; then forces among them grow until one slips. Newton's method follows them there, ADMM sorts the others.
        """
        assert start.motion is not None
        many = many_bodies(problem)
        found = self._bodies(problem, many)(problem, start)
        found = replace(found, why="admm of bodies: motion")
        best = found
        methods = [("Newton", self._following), ("admm of bodies", self._sorting)]
        most = (1.0 if many else _TRIED) * self.max_iterations
        while not found.converged and best.iterations < most:
            for name, solve in [("admm of bodies", self._turning)] if many else methods:
                count = max(self.max_iterations - best.iterations, 1)
                begin = ContactStart(found.impulse, found.velocity)
                why = f"{name}: admm of bodies stood at η {found.natural_map:.0e}"
                found = self._judged(problem, solve(count)(problem, begin), why)
                best = _better(best, found)
                if found.converged:
                    break
        still = best.converged and not self._slides(problem, best)
        # methods for rest have just failed where the step was not yet part of a motion
        return replace(best, motion=start.motion - 1 if still and start.motion else _MOTION)

    def _in_motion(self, problem: ContactProblem) -> "Alternating":
        """Return the strategy with the tolerances of a step of a motion."""
        pace = float(np.abs(problem.u_free).max())
        if self.motion_speed is None or pace == 0.0:
            return self
        velocity = min(max(self.motion_speed / pace, self.velocity_tolerance), _LOOSEST)
        # η tells next to nothing of a motion: the forces of the step before have one of 10⁻⁴
        natural_map = max(self.tolerance, min(velocity, _LOOSEST_MAP))
        return replace(self, velocity_tolerance=velocity, tolerance=natural_map)

    def _bodies(self, problem: ContactProblem, many: bool) -> _Solver:
        limits = self.tolerance, self.velocity_tolerance, self.max_iterations
        if self.velocity_tolerance < _LOOSE:
            solver = BodyADMM(*limits, further=_MOTION_FURTHER)
            return lambda p, s: solver(p, s if s.ahead is None else s.ahead)
        # errors of this size would be extrapolated with the rest
        if many:
            return BodyADMM(*limits, TURNS)
        loosest = _LOOSEST * float(np.abs(problem.u_free).max())
        allowed = self.motion_speed or 0.0
        rough = (stages for times, stages in _ROUGH if allowed >= times * loosest)
        return BodyADMM(*limits, next(rough, _LOOSE_STAGES))

    def _following(self, most: int) -> _Solver:
        # in units in which contacts yield alike, what is solved is nearly so in others
        return _even(ProximalNewton(*self._tight, min(_FOLLOWING, most)))

    def _sorting(self, most: int) -> _Solver:
        return BodyADMM(self.tolerance, self.velocity_tolerance, most, _SORTING)

    def _turning(self, most: int) -> _Solver:
        return BodyADMM(self.tolerance, self.velocity_tolerance, most, TURNS)

    def _in_turns(self, most: int) -> _Solver:
        # Newton's method has its turn where these are in vain
        return self._turning(min(_TURNS_ITERATIONS, max(most - _NEWTON_STEPS, 1)))

    def _cold(self, most: int) -> _Solver:
        # the interior point has its turn where these are in vain
        return BodyADMM(*self._tight, max(most - _INTERIOR, 1), FROM_NOTHING)

    def _cold_many(self, most: int) -> _Solver:
        return BodyADMM(*self._tight, most, (_STICKING, *FROM_NOTHING), further=_STICKING_FURTHER)

    def _slides(self, problem: ContactProblem, found: ContactSolution) -> bool:
        """Return whether a contact that carries a force moves by more than the solution leaves undecided."""
        carries = found.impulse.any(axis=1)
        return bool(np.abs(found.velocity[carries]).max(initial=0.0) > self._pace(problem))

    def _rests(self, problem: ContactProblem, impulse: Array) -> bool:
        """Return whether impulses let no contact move, neither one that carries a force nor one that opens."""
        u = problem.delassus.apply(impulse) + problem.u_free
        return bool(np.abs(u).max() <= self._pace(problem))

    def _pace(self, problem: ContactProblem) -> float:
        """Return the velocity up to which a contact rests [m/s]."""
        return min(_SLIDES * self.velocity_tolerance, _SLOW) * float(np.abs(problem.u_free).max())

    def _stages(
        self, problem: ContactProblem, warm: bool, motion: bool, many: bool
    ) -> Iterator[tuple[str, Callable[[int], _Solver], bool]]:
        """Yield names, solvers by their largest number of iterations, and whether each begins with the best so far."""
        limits = self.tolerance, self.velocity_tolerance
        if many and not warm:
            yield "admm of bodies", self._cold_many, False
        # from nothing, sweeps would leave much of the friction where they happen to begin
        if warm or problem.delassus.form is None:
            yield "sweeps", self._first, False
        if problem.delassus.form is not None:
            yield "admm, small penalty", self._static, False
            later = [("admm, balanced penalty", self._moving, False)]
            if problem.delassus.rigid is not None:
                some = some_bodies(problem)
                if some and not (warm or motion):
                    yield "admm of bodies", self._cold, False
                if motion and not (warm or many):
                    yield "admm of bodies", self._ended, True
                newton = [("Newton", self._newton, False)]
                interior = [
                    ("interior point", self._interior, False),
                    ("Newton from forces that do not clamp", self._released, True),
                    ("Newton on the natural map", self._ending, True),
                    ("admm", self._last, True),
                ]
                if not self.thorough:
                    # where others stand near a solution these may find one from nothing, for a tenth of their time
                    interior = [interior[0], interior[-1], ("admm of bodies", self._in_turns, False)]
                if warm and some and not self.thorough:
                    later = [("admm of bodies", self._in_turns, False), *newton]
                elif warm:
                    later = newton + later + interior
                elif some:
                    later = interior[:1] + newton + interior[1:] + later
                else:
                    later = newton + interior + later
            yield from later
        if self.thorough or problem.delassus.form is None:
            yield "sweeps", lambda most: NSGS(*limits, most, _LOOK, _DEPTH), True

    def _first(self, most: int) -> _Solver:
        limits, tight = (self.tolerance, self.velocity_tolerance), self._tight

        def solve(problem: ContactProblem, start: ContactStart) -> ContactSolution:
            # errors that η does not see in a tall stack would add up from step to step, so sweeps go further than asked
            # for; a start that is still a solution is kept
            goal = limits if residual(problem, start.impulse).within(*limits) else tight
            return NSGS(*goal, min(_FIRST_SWEEPS, most), _LOOK, _DEPTH)(problem, start)

        return solve

    @property
    def _tight(self) -> tuple[float, float]:
        return _FURTHER * self.tolerance, _FURTHER * self.velocity_tolerance

    def _static(self, most: int) -> _Solver:
        solver = ADMM(
            *self._tight,
            min(_STATIC_ITERATIONS, most),
            _STATIC_PENALTY,
            _STATIC_LOOK,
            _STATIC_PATIENCE,
            over_relaxation=1.0,
        )
        # velocities of sweeps end near a solution, but lead a small penalty astray
        return _even(lambda p, s: solver(p, ContactStart(s.impulse, np.zeros_like(s.velocity))))

    def _ended(self, most: int) -> _Solver:
        solver = BodyADMM(*self._tight, most, _ENDING)

        def solve(problem: ContactProblem, start: ContactStart) -> ContactSolution:
            found = solver(problem, ContactStart(start.impulse, np.zeros_like(start.velocity)))
            if self._rests(problem, found.impulse):
                return found
            # forces that press moving stones against each other would slow all steps that follow: Newton's are smaller
            return replace(found, impulse=start.impulse, velocity=start.velocity)

        return solve

    def _newton(self, most: int) -> _Solver:
        return _even(ProximalNewton(*self._tight, min(_NEWTON_STEPS, most)))

    def _moving(self, most: int) -> _Solver:
        return moving_admm(self.tolerance, self.velocity_tolerance, min(_MOVING_ITERATIONS, most))

    def _interior(self, most: int) -> _Solver:
        solver = InteriorPoint(self.tolerance, self.velocity_tolerance, min(_INTERIOR, most))
        # the Newton's method that it begins with has had its try
        return lambda p, s: solver(p, ContactStart(np.zeros_like(s.impulse), s.velocity))

    def _ending(self, most: int) -> _Solver:
        return _even(Newton(*self._tight, min(_ENDING_STEPS, most)))

    def _released(self, most: int) -> _Solver:
        solver = Newton(*self._tight, min(_ENDING_STEPS, most))

        # stones that clamp each other at the edge of sliding leave less friction to the rest, which no residual shows
        # where all but the lightest are far heavier
        return _even(lambda p, s: solver(p, ContactStart(_without_self_stress(p, s.impulse), s.velocity)))

    def _last(self, most: int) -> _Solver:
        return _even(ADMM(*self._tight, min(_LAST_ITERATIONS, most), _LAST_PENALTY))

    def _judged(self, problem: ContactProblem, found: ContactSolution, why: str) -> ContactSolution:
        left = residual(problem, found.impulse)
        within = left.within(self.tolerance, self.velocity_tolerance)
        return replace(found, natural_map=left.natural_map, converged=within, why=why)


def many_bodies(problem: ContactProblem) -> bool:
    """Return whether so many rigid bodies move that kept factors beat Newton's method."""
    return _moving(problem) >= _MANY


def some_bodies(problem: ContactProblem) -> bool:
    """Return whether at least 300 rigid bodies move, among which Newton's method alone may wander."""
    return _moving(problem) >= _SOME


def _moving(problem: ContactProblem) -> int:
    """Return the number of rigid bodies that move."""
    contacts = problem.delassus.rigid
    return 0 if contacts is None else int(np.count_nonzero(contacts.inertia[:, 0]))


def _without_self_stress(problem: ContactProblem, impulse: Array) -> Array:
    """Return the smallest impulses (nc, 3) that load the bodies alike, projected on the cones.

    (W + α) Δ = W (r - r̂) a few times (Riley 1955): what no body feels stays out.
    """
    operator = problem.delassus
    system = problem.form("forces without self-stress").shifted(
        np.tile(_RELEASE * operator.scale * np.eye(3), (len(impulse), 1, 1))
    )
    least = np.zeros_like(impulse)
    for _ in range(_RELEASES):
        least += system(operator.apply(impulse - least).ravel()).reshape(impulse.shape)
    return project_on_cone(least, problem.friction, problem.cohesion)


def _even(solver: _Solver) -> _Solver:
    """Return the solver in units in which the contacts of rigid bodies yield alike."""

    def solve(problem: ContactProblem, start: ContactStart) -> ContactSolution:
        if problem.delassus.rigid is None:
            return solver(problem, start)
        return solved_evenly(solver, problem, start)

    return solve


def _better(one: ContactSolution, other: ContactSolution) -> ContactSolution:
    """Return the one that is solved or has the smaller η, with the iterations of both."""
    best = min(one, other, key=lambda solution: (not solution.converged, solution.natural_map))
    return replace(best, iterations=one.iterations + other.iterations)
