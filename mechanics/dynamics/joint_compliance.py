"""Compliance of joints, the way out where a step with rigid ones cannot be solved."""

from dataclasses import dataclass, replace

from mechanics.model.model import Model
from mechanics.problem.problem import Delassus, mean_diagonal
from mechanics.scene.scene import Method

__all__ = ["SOFTNESS", "JointCompliance", "may_yield"]

SOFTNESS = (1.0, 3.0, 10.0)
"""Factors on the compliance of joints, tried in turn where a step cannot be solved with it either."""

# compliant steps after which rigid joints are tried again, at first; twice as many after each failure
_FIRST_WAIT = 8


def may_yield(model: Model) -> bool:
    """Return whether joints of a run may yield: on the way to a rest alone, as in a motion they would decide it.

    Joints with springs of their own yield in every step; where most stones deform, these do.
    """
    settings, elastic = model.scene.solver, int(model.elastic.sum())
    automatic = settings.method is Method.AUTO and settings.joint_compliance > 0
    rest = model.scene.time.relaxation and not model.laws.sprung
    return automatic and rest and not 0 < elastic >= int(model.inertia.moving.sum())


@dataclass(frozen=True)
class JointCompliance:
    """Compliance of the joints of a run: none until a step with rigid joints could not be solved.

    Attributes
    ----------
    value : ε of all joints once it has been needed, kept from then on; 0 until then [1/kg]
    left : steps with compliant joints still to come, before rigid joints are tried again; negative: steps that are left
        to rigid joints alone, as compliant ones have failed, too
    wait : number of steps after the next failure of either
    softness : factor on ε with which the last step with compliant joints was solved [-]
    lasting : once needed, joints stay compliant: where stones deform, too, by as much
    """

    value: float = 0.0
    left: int = 0
    wait: int = _FIRST_WAIT
    softness: float = 1.0
    lasting: bool = False

    @property
    def rigid(self) -> bool:
        """True where the next step is tried with rigid joints."""
        return self.left <= 0

    def needed(self, operator: Delassus, share: float) -> "JointCompliance":
        """Return the state after a failure with rigid joints: ε is a share of the mean diagonal of W [-]."""
        value = self.value or share * mean_diagonal(operator.diagonal)
        return replace(self, value=value, left=self.wait, wait=2 * self.wait, softness=1.0)

    def softer(self, factor: float) -> "JointCompliance":
        """Return the state with joints that many times as compliant."""
        return replace(self, value=factor * self.value)

    def used(self, softness: float) -> "JointCompliance":
        """Return the state after a step with compliant joints."""
        return replace(self, left=self.left - (not self.lasting), softness=softness)

    def released(self) -> "JointCompliance":
        """Return the state in which forces are forgotten, which rigid joints bear as they lie, if they may be tried."""
        return self if self.lasting else replace(self, left=min(self.left, 0))

    def failed(self) -> "JointCompliance":
        """Return the state after a step that could not be solved at all."""
        return replace(self, left=-self.wait, wait=2 * self.wait)

    def passed(self) -> "JointCompliance":
        """Return the state after a step with rigid joints."""
        return replace(self, left=min(self.left + 1, 0))
