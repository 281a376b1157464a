"""One contact with a scalar W, solved by hand: the laws without the engine."""

from dataclasses import dataclass, field

import numpy as np

from mechanics.scene.laws.law import STATE, Approach, Law


def approach(gap, speed=0.0, state=None, slide=0.0, **changed):
    """Contacts as a law sees them; numbers are repeated for each."""
    gap = np.atleast_1d(np.asarray(gap, dtype=float))
    given = {"area": 1.0, "size": 1.0, "compliance": 1.0} | {
        name: changed.pop(name) for name in ("area", "size", "compliance") if name in changed
    }
    full = {name: np.broadcast_to(np.asarray(value, dtype=float), gap.shape) for name, value in given.items()}
    settings = {
        "step": 1e-3,
        "theta": 0.5,
        "push_out": False,
        "first": False,
        "pair": np.arange(len(gap)),
    } | changed
    settings["first"] = np.full(len(gap), settings["first"])
    state = np.zeros((len(gap), STATE)) if state is None else np.array(state, dtype=float)
    slide = np.broadcast_to(np.asarray(slide, dtype=float), (len(gap), 2))
    motion = {"speed": np.broadcast_to(float(speed), gap.shape), "slide": slide}
    return Approach(gap=gap, state=state, **motion, **full, **settings)


@dataclass
class Block:
    """A mass above a wall, moved by the θ-scheme under a constant force (normal, tangential) [N]."""

    law: Law
    mass: float = 1.0
    area: float = 1.0
    size: float = 1.0
    step: float = 1e-3
    theta: float = 0.5
    force: tuple[float, float] = (0.0, 0.0)
    place: np.ndarray = field(default_factory=lambda: np.zeros(2))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(2))
    state: np.ndarray = field(default_factory=lambda: np.zeros((1, STATE)))
    first: bool = True
    work: float = 0.0
    impulse: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def advance(self, steps=1):
        for _ in range(steps):
            self._advance()
        return self

    def _advance(self):
        h, theta, mass = self.step, self.theta, self.mass
        contact = approach(
            self.place[0] + h * (1 - theta) * self.velocity[0],
            self.velocity[0],
            self.state,
            area=self.area,
            size=self.size,
            compliance=1 / mass,
            step=h,
            theta=theta,
            first=self.first,
        )
        terms = self.law.terms(contact)
        bias, friction, cohesion, adhesion = (
            float(one[0]) for one in (terms.bias, terms.friction, terms.cohesion, terms.adhesion)
        )
        free = self.velocity + h * np.array(self.force) / mass
        free[0] -= adhesion / mass
        normal = max(0.0, -mass * (free[0] + bias))
        limit = friction * normal + cohesion
        shifted = np.array([normal, float(np.clip(-mass * free[1], -limit, limit))])
        after = free + shifted / mass
        self.state = self.law.after(contact, shifted[None], after[None])
        self.impulse = shifted - [adhesion, 0.0]
        mean = theta * after + (1 - theta) * self.velocity
        self.work += float(self.impulse @ mean)
        self.place = self.place + h * mean
        self.velocity, self.first = after, False
