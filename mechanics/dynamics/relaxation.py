"""Kinetic damping (Cundall 1976), and bringing bodies to a halt."""

from dataclasses import replace

import numpy as np

from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.model.model import Model
from mechanics.scene.state import State

__all__ = ["Relaxation", "halted"]


class Relaxation:
    """Kinetic damping: all bodies are halted each time their kinetic energy has passed a peak (Cundall 1976).

    Parameters
    ----------
    model : a scene; without `relaxation` in its time settings nothing is halted
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._kinetic = 0.0

    def __call__(self, state: State) -> State:
        """Return the state with which a run goes on after the end of a step."""
        if not self._model.scene.time.relaxation:
            return state
        kinetic, last = kinetic_energy(self._model, state), self._kinetic
        falling = kinetic < last
        self._kinetic = 0.0 if falling else kinetic
        return halted(state) if falling else state


def halted(state: State) -> State:
    """Return the same configuration with all velocities at zero."""
    return replace(
        state, velocity=np.zeros_like(state.velocity), node_velocity=np.zeros_like(state.node_velocity)
    )
