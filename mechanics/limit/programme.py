"""The cone programme of an assembly: forces within the strength of the joints that balance the loads.

    minimise  c·f - λ + ρ/2 Σ (f_N - n̄)²   over   H f + p + λ q = 0,   λ ≥ 0,   ‖f_T‖ ≤ μ (f_N + s) + k,   f_N + s ≥ 0

without λ where there is no live load q, without ρ where no normal forces n̄ are given; and, where stones crush, the
stress blocks of `mechanics.limit.joints`.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy.sparse import block_array, csc_array, csr_array, diags_array, vstack

from ground.errors import SolverError
from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly, Strength

# friction from which a contact has a cone [-]
_SMOOTH = 1e-9
# tolerance asked of Clarabel, of gap and feasibility [-]
_TOLERANCE = 1e-9
# that of a programme that is one of many on the way, solved without scaling and refinement: in half the time
_ROUGH = 1e-6


# statuses of Clarabel
_SOLVED = ("Solved", "AlmostSolved")
_NO_BALANCE = ("PrimalInfeasible", "AlmostPrimalInfeasible")
_ENDLESS = ("DualInfeasible", "AlmostDualInfeasible")


class Ending(StrEnum):
    """Ending of a programme."""

    FOUND = "found"
    NO_BALANCE = "no balance"
    ENDLESS = "endless"


@dataclass(frozen=True)
class Optimum:
    """Answer of one programme.

    Attributes
    ----------
    ending : whether there is one
    multiplier : λ; NaN without balance, infinite where nothing limits it
    force : (nc, 3) [N]
    velocity : (n, 6) of the free stones, of any length: the dual variables of the balance
    """

    ending: Ending
    multiplier: float
    force: Array
    velocity: Array


@dataclass(frozen=True)
class _Cones:
    """Rows of which `rows` f + `bound` lie in cones, in this order: zero, second order, nonnegative."""

    rows: "csc_array[np.float64]"
    bound: Array
    zero: int
    second_order: int
    nonnegative: int

    def with_one_more(self) -> "_Cones":
        """Return the cones with one more unknown, which is not negative."""
        rows = csc_array(block_array([[self.rows, None], [None, csc_array([[1.0]])]]))
        return replace(self, rows=rows, bound=np.append(self.bound, 0.0), nonnegative=self.nonnegative + 1)


class Programme:
    """The cone programme of an assembly and a load, for any strength of its joints.

    Forces are in units of the largest load on a stone, moments in that times the width of each stone, so that all rows
    of the balance weigh alike.

    Parameters
    ----------
    on : the assembly
    live : (6 n,) load at λ = 1 [N, N m]; None: there is no λ
    name : of the load, in errors
    tolerance : of gap and feasibility; velocities that are to be derivatives need less than λ does [-]

    Raises
    ------
    SolverError : the live load is zero
    """

    def __init__(
        self, on: RigidAssembly, live: Array | None, name: str, tolerance: float = _TOLERANCE
    ) -> None:
        self._on, self._name, self._tolerance = on, name, tolerance
        load = np.zeros_like(on.dead) if live is None else live
        if live is not None and not load.any():
            raise SolverError("the live load is zero", where=name, remedy="give one that acts on stones")
        size = on.model.surfaces.size[on.free]
        self._unit = max(float(np.abs(on.dead).max()), float(np.abs(load).max())) or 1.0
        row = np.column_stack([np.ones((len(size), 3)), np.repeat(1.0 / size[:, None], 3, axis=1)]).ravel()
        self._row, self._dead = row, row * on.dead / self._unit
        self._live = live
        self._live_unit = float(np.linalg.norm(row * load)) / self._unit or 1.0
        balance = csr_array(diags_array(row) @ on.lift)
        if live is not None:
            column = csr_array((row * load / self._unit / self._live_unit)[:, None])
            balance = block_array([[balance, column]], format="csr")
        self._balance = csc_array(balance)
        self._weight = max(on.weight, float(np.abs(load).sum()))

    def solve(
        self,
        strength: Strength,
        clamping: float = 0.0,
        cost: Array | None = None,
        near: Array | None = None,
        pull: float = 0.0,
    ) -> Optimum:
        """Return the answer for a strength of the contacts.

        Parameters
        ----------
        clamping : charge on the sum of all normal forces over the weight, in units of λ; with one, the answer is one of
            many on a way, and rough
        cost : (nc, 3) c of the forces [-]
        near : (nc,) normal forces near which the new ones stay [N]
        pull : charge on the squares of how far they are from these, over their mean and the weight, in units of λ

        Raises
        ------
        SolverError : Clarabel is not installed, or came to no answer
        """
        cones, count, live = self._cones(strength), 3 * len(strength.friction), self._live is not None
        if live:
            # λ ≥ 0: stones that stand only as the live load holds them do not stand
            cones = cones.with_one_more()
        objective = np.zeros(count + int(live))
        objective[count:] = -1.0
        objective[:count] += 0.0 if cost is None else cost.ravel()
        charge = self._live_unit * self._unit / self._weight
        objective[:count:3] += clamping * charge
        squares = np.zeros(len(objective))
        if near is not None:
            target = near / self._unit
            squares[:count:3] = pull * charge / (float(np.abs(target).mean()) or 1.0)
            objective[:count:3] -= squares[:count:3] * target
        status, x, z = self._solved(
            cones, self._balance, "zero", -self._dead, objective, squares, clamping > 0
        )
        velocity, none = (self._row * z[: len(self._row)]).reshape(-1, 6), np.zeros((count // 3, 3))
        if status in _ENDLESS:
            return Optimum(Ending.ENDLESS, float("inf"), none, np.zeros_like(velocity))
        if live or status in _NO_BALANCE:
            # the loads do work on the mechanism
            driving = self._on.dead if self._live is None or status in _NO_BALANCE else self._live
            velocity = velocity if velocity.ravel() @ driving >= 0 else -velocity
        if status in _NO_BALANCE:
            return Optimum(Ending.NO_BALANCE, float("nan"), none, velocity)
        multiplier = float(x[-1]) / self._live_unit if live else float("nan")
        return Optimum(Ending.FOUND, multiplier, self._unit * x[:count].reshape(-1, 3), velocity)

    def shortfall(self, strength: Strength) -> Optimum:
        """Return the forces that come nearest to balancing the dead load; `multiplier` is the residual imbalance.

        It is the largest component of the imbalance, over the largest load on a stone, with moments over widths [-].

        Raises
        ------
        SolverError : Clarabel is not installed, or came to no answer
        """
        count = 3 * len(strength.friction)
        balance = self._balance[:, :count]
        lacking = csc_array(np.full((2 * balance.shape[0], 1), -1.0))
        sides = csc_array(block_array([[vstack([balance, -balance]), lacking]]))
        objective = np.zeros(count + 1)
        objective[-1] = 1.0
        _, x, z = self._solved(
            self._cones(strength).with_one_more(),
            sides,
            "nonnegative",
            np.concatenate([-self._dead, self._dead]),
            objective,
        )
        half = len(self._row)
        velocity = (self._row * (z[half : 2 * half] - z[:half])).reshape(-1, 6)
        velocity = velocity if velocity.ravel() @ self._on.dead >= 0 else -velocity
        return Optimum(Ending.FOUND, float(x[-1]), self._unit * x[:-1].reshape(-1, 3), velocity)

    def _solved(
        self,
        cones: "_Cones",
        balance: "csc_array[np.float64]",
        kind: str,
        right: Array,
        objective: Array,
        squares: Array | None = None,
        rough: bool = False,
    ) -> tuple[str, Array, Array]:
        """Return status, unknowns and dual variables; the rows of the balance come first.

        What cannot be solved roughly is solved with care.
        """
        import clarabel

        first = clarabel.ZeroConeT if kind == "zero" else clarabel.NonnegativeConeT
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        settings.equilibrate_enable = settings.iterative_refinement_enable = not rough
        tolerance = _ROUGH if rough else self._tolerance
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
        quadratic = csc_array(diags_array(np.zeros(len(objective)) if squares is None else squares))
        answer = clarabel.DefaultSolver(
            quadratic,
            objective,
            csc_array(vstack([balance, -cones.rows])),
            np.concatenate([right, cones.bound]),
            [
                first(balance.shape[0]),
                clarabel.ZeroConeT(cones.zero),
                *[clarabel.SecondOrderConeT(3)] * cones.second_order,
                clarabel.NonnegativeConeT(cones.nonnegative),
            ],
            settings,
        ).solve()
        status = str(answer.status)
        if rough and status != _SOLVED[0]:
            return self._solved(cones, balance, kind, right, objective, squares)
        if status not in _SOLVED + _NO_BALANCE + _ENDLESS:
            raise SolverError(
                f"Clarabel came to no answer: {status}",
                where=self._name,
                remedy="check the scene's joints with `moma check`",
            )
        return status, np.asarray(answer.x), np.asarray(answer.z)

    def _cones(self, strength: Strength) -> "_Cones":
        """Return the cones of the strength of all contacts, and of crushing."""
        count, tension = len(strength.friction), strength.tension / self._unit
        rough = (strength.friction > _SMOOTH) | (strength.cohesion > 0)
        flat, cone = np.flatnonzero(~rough), np.flatnonzero(rough)
        side = np.flatnonzero(~rough | (strength.cohesion > 0))
        factor = np.ones((count, 3))
        factor[:, 0] = strength.friction
        identity = csr_array(diags_array(np.ones(3 * count)))
        blocks, right = self._crushing()
        rows = vstack(
            [
                identity[(3 * flat[:, None] + [1, 2]).ravel()],
                csr_array(diags_array(factor.ravel()))[(3 * cone[:, None] + np.arange(3)).ravel()],
                *([blocks] if len(right) else []),
                identity[3 * side],
            ],
            format="csc",
        )
        limit = np.zeros((len(cone), 3))
        limit[:, 0] = (strength.cohesion / self._unit + strength.friction * tension)[cone]
        return _Cones(
            rows=rows,
            bound=np.concatenate([np.zeros(2 * len(flat)), limit.ravel(), right, tension[side]]),
            zero=2 * len(flat),
            second_order=len(cone) + len(right) // 3,
            nonnegative=len(side),
        )

    def _crushing(self) -> tuple["csr_array[np.float64]", Array]:
        """Return rows and right side of the cones of stress blocks: 2 a b ≥ N², a = σ w and b = Σ f_N (y - y_i)."""
        blocks = self._on.crushing
        if blocks is None:
            return csr_array((0, 3 * len(self._on.contacts))), np.zeros(0)
        edges, longest = len(blocks.limit), np.maximum(np.abs(blocks.lever).max(axis=1), 1e-300)
        # in units of the width of the section, so that the two terms of the cone are alike
        lever, limit = blocks.lever / longest[:, None], blocks.limit * longest / self._unit
        place = np.flatnonzero(blocks.point >= 0)
        edge, column = np.divmod(place, blocks.point.shape[1])
        column = 3 * blocks.point[edge, column]
        value, shape = lever.ravel()[place], (3 * edges, 3 * len(self._on.contacts))
        rows = csr_array(
            (
                np.concatenate([value, -value, np.full(len(value), np.sqrt(2.0))]),
                (
                    np.concatenate([3 * edge, 3 * edge + 1, 3 * edge + 2]),
                    np.tile(column, 3),
                ),
            ),
            shape=shape,
        )
        return rows, np.column_stack([limit, limit, np.zeros(edges)]).ravel()
