"""One contact whose two sides are driven along a path: what a law answers, without an engine."""

from dataclasses import dataclass, field, replace

import numpy as np

from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import ENERGY, STATE
from tests.mechanics.scene.laws.one_contact import approach


@dataclass
class Driven:
    """An elastic joint of 1 m² between driven sides.

    Attributes
    ----------
    place : gap and two slides so far [m]
    work : of the joint on its sides so far [J]
    """

    law: ElasticJoint
    step: float = 1e-3
    theta: float = 0.5
    first: bool = False
    place: np.ndarray = field(default_factory=lambda: np.zeros(3))
    state: np.ndarray = field(default_factory=lambda: np.zeros((1, STATE)))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    work: float = 0.0

    @property
    def held(self):
        """What the springs hold [J]."""
        return float(self.state[0, ENERGY])

    def path(self, places, axis=0):
        """Drive one coordinate through places (n,), one a step; return its tractions (n,), tension positive."""
        return np.array([self._to(place, axis)[axis] for place in places])

    def _to(self, place, axis):
        """Sides move at one mean velocity; the velocities before and after the step are that of the mean."""
        h, velocity = self.step, np.zeros(3)
        velocity[axis] = (place - self.place[axis]) / h
        contact = approach(
            [self.place[0] + h * (1 - self.theta) * velocity[0]],
            velocity[0],
            self.state,
            velocity[None, 1:],
            step=h,
            theta=self.theta,
            first=self.first,
        )
        contact = replace(contact, crushing=self.law.crushing(contact))
        for _ in range(5):
            terms = self.law.terms(contact)
            across, *along = terms.springs.compliance[0]
            shifted = np.zeros(3)
            shifted[0] = max(0.0, -(velocity[0] + terms.bias[0]) / across + terms.adhesion[0])
            shifted[1:] = -(velocity[1:] + terms.springs.shift[0]) / along
            limit = terms.friction[0] * shifted[0] + terms.cohesion[0]
            shifted[1:] *= min(1.0, limit / max(np.linalg.norm(shifted[1:]), 1e-300))
            crushing = self.law.crushing(contact, shifted[None])
            if np.array_equal(crushing, contact.crushing):
                break
            contact = replace(contact, crushing=crushing)
        self.state = self.law.after(contact, shifted[None], velocity[None])
        impulse = shifted - [terms.adhesion[0], 0.0, 0.0]
        self.work += float(impulse @ velocity)
        self.place, self.first = self.place + h * velocity, False
        return -impulse / h
