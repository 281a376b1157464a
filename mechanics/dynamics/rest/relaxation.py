"""Kinetic damping (Cundall 1976), and bringing bodies to a halt."""

from dataclasses import replace

import numpy as np

from mechanics.carried import Carrier
from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.model.model import Model
from mechanics.scene.state import State


class Relaxation(Carrier):
    """Kinetic damping: all bodies are halted each time their kinetic energy has passed a peak (Cundall 1976).

    Parameters
    ----------
    model : a scene; nothing is halted without `relaxation` in its time settings, nor where stones begin in motion,
        as the first halt would take away what is to be followed
    """

    CARRIED = ("_kinetic",)
    REBUILT = ("_halts", "_model")

    def __init__(self, model: Model) -> None:
        self._model = model
        self._halts = model.scene.time.relaxation and not _in_motion(model)
        self._kinetic = 0.0

    def __call__(self, state: State) -> State:
        """Return the state with which a run goes on after the end of a step."""
        if not self._halts:
            return state
        kinetic, last = kinetic_energy(self._model, state), self._kinetic
        falling = kinetic < last
        self._kinetic = 0.0 if falling else kinetic
        return halted(state) if falling else state


def relaxation_caution(model: Model) -> str | None:
    """Return what a reader of a relaxation's verdict must know of it; None if it needs no word."""
    if not model.scene.time.relaxation:
        return None
    if _in_motion(model):
        return "nothing was halted, as stones begin in motion: relaxation finds rest from rest only"
    if model.scene.loads.until > 0:
        return "relaxation left out the inertia of the motion while loads or supports changed"
    return None


def _in_motion(model: Model) -> bool:
    return any(any(block.velocity) for block in model.scene.blocks)


def halted(state: State) -> State:
    """Return the same configuration with all velocities at zero."""
    return replace(
        state, velocity=np.zeros_like(state.velocity), node_velocity=np.zeros_like(state.node_velocity)
    )
