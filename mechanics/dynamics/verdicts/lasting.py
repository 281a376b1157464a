"""Rest of a scene: balance and speed, and whether it lasts once its contact forces are forgotten."""

from dataclasses import replace

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.observers.equilibrium import displacement, imbalance, seen_from_supports, speed
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.model.model import Model
from mechanics.scene.state import State

LASTING = 5
"""Steps in a row that must be in balance."""

_REST_SPEED = 1e-4  # of √(g · width), the speed of a fall over a body's own width, below which it rests [-]
_RELEASED = 50  # most steps in which a rest must show that it lasts without its forces
_STAYS = 1e-3  # displacement over the width within which a released stone stays where it rested [-]


def balance_of(model: Model, step: Step) -> Array:
    """Return the imbalance of each body (nb,) after a step [-].

    Between rigid stones it is that of the configuration in which the forces were found: a stone that carries thousands
    of times its own weight would be out of balance by what the point of such a load moves within the error of a step.
    """
    active, after = step.active, step.after
    place = replace(step.found.configuration, time=after.time) if model.rigid_only else after
    return imbalance(model, place, active.contacts, active.force, step.kick.load, step.resting)


def disproof(simulation: Simulation) -> tuple[Simulation | None, bool]:
    """Return the simulation with which a run goes on where a rest does not last, and whether its stones surely move.

    Without a simulation it lasts. Rigid stones in a gap admit forces that press them against each other without cause:
    an overlap that was pushed out, an impact or a solver's long way may leave such forces, and friction then holds what
    nothing carries. So the stones forget all contact forces, and must find those of their rest again without leaving
    it: rigid ones from forces that arise from nothing.
    """
    released = simulation.released()
    at_rest = released.rests_from_nothing()
    lasting = _lasts(released.released(forgets=False)) if at_rest is None else at_rest
    return None if lasting else released, at_rest is False


def _lasts(simulation: Simulation) -> bool:
    """Return whether a rest lasts in a released simulation, which this advances."""
    model, begin = simulation.model, simulation.state
    quiet = 0
    for _ in range(_RELEASED):
        step = simulation.step()
        seen = seen_from_supports(model, begin, step.after)
        if moves(model, begin, seen):
            return False
        speeds = np.where(model.fixed, 0.0, speed(model, seen))
        calm = step.solution.converged and _rests(model, step.after, balance_of(model, step), speeds)
        quiet = quiet + 1 if calm else 0
        if quiet >= LASTING:
            return True
    return False


def moves(model: Model, before: State, after: State) -> bool:
    """Return whether a stone has left the place where it rested."""
    moved = displacement(model, before, after) > _STAYS * model.surfaces.size
    return bool(moved[~model.fixed].any())


def rests(model: Model, state: State, balance: Array) -> bool:
    """Return whether all bodies are in balance (nb,) and slow, where no support is driven."""
    return _rests(model, state, balance, np.where(model.fixed, 0.0, speed(model, state)))


def _rests(model: Model, state: State, balance: Array, speeds: Array) -> bool:
    """Return whether all bodies are in balance (nb,) and slow (nb,)."""
    balanced = balance.max() <= model.scene.time.balance_tolerance
    return bool(balanced and (speeds <= rest_speed(model, state)).all())


def rest_speed(model: Model, state: State) -> Array:
    """Return the speed of each body (nb,) below which it rests [m/s].

    A dashpot over a spring, c = τ k, may balance what the spring has yet to bear; a body then has the way v τ to go.
    """
    slow: Array = _REST_SPEED * fall_speed(model, state)
    return np.minimum(slow, _STAYS * model.surfaces.size / model.lag) if model.lag > 0.0 else slow


def fall_speed(model: Model, state: State) -> Array:
    """Return √(g · width) of each body (nb,) [m/s], with g = 1 m/s² where there is no gravity."""
    speed: Array = np.sqrt((float(np.linalg.norm(model.gravity(state.time))) or 1.0) * model.surfaces.size)
    return speed
