"""Protocol of contact laws: contacts in, a shift of (u, r) and a friction cone out.

Once per step each law states all its contacts in the common form of all solvers: with r̃ = r + s n

    0 ≤ u_N + bias ⊥ r̃_N ≥ 0,   ‖r_T‖ ≤ μ r̃_N + k,   and r_T opposes u_T, at the limit, while sliding

A new law is one class with the members of `Law`; what it does not say it inherits from `Joint`.
"""

import math
from dataclasses import dataclass
from typing import Protocol, cast

import numpy as np

from mechanics.arrays import Array, Bools, Ints

# columns of the internal variables that a contact carries from step to step
BOND, SLIDING, OPENING, SLIP, REST = range(5)
SPRING = slice(5, 8)
ENERGY = 8
CRUSHED = 9
STATE = 10


@dataclass(frozen=True)
class Approach:
    """Contacts of one law at the predicted configuration, before the step is solved.

    Attributes
    ----------
    gap : (n,) signed distance, negative when overlapping [m]
    speed : (n,) u_N before the step, positive when opening [m/s]
    slide : (n, d - 1) u_T before the step [m/s]
    area : (n,) tributary area; zero at an edge or a corner [m²]
    size : (n,) smallest width of the smaller body; tolerances scale with it [m]
    compliance : (n,) W_NN, change of u_N per unit of normal impulse [1/kg]
    step, theta : h [s] and θ; the gap is gap + h θ u_N at the end of the step, and gap + h u_N at the next kick
    push_out : overlaps are pushed out (relaxation) instead of only kept from growing
    pair : (n,) number of the pair of shapes that each belongs to
    first : (n,) contacts of stones that meet as the run, or a stage of building, begins: bonds are made in them
    state : (n, STATE) internal variables, as the law left them in the last step; zeros for new contacts.
        BOND intact fraction (1 whole, between: damaged, 0 never bonded, -1 broken), SLIDING 1 if it slid in the last
        step, OPENING largest opening so far [m], SLIP path of sliding so far [m], REST gap that counts as closed, where
        stones overlapped or mortar filled a joint as they met [m], SPRING three columns of springs, local frame: what
        their stretch exceeds the gap across the joint, and their stretch along it, which is what the candidate has
        moved over the antagonist in them [m], ENERGY what they hold [J], CRUSHED closure by crushing so far, by which
        REST is lower [m]
    thickness : (n,) of the mortar in the joints, zero where it is not known; None: nowhere [m]
    crushing : (n,) contacts whose pressure exceeds the strength of their joint in this step; None: not known yet
    """

    gap: Array
    speed: Array
    slide: Array
    area: Array
    size: Array
    compliance: Array
    step: float
    theta: float
    push_out: bool
    pair: Ints
    first: Bools
    state: Array
    thickness: Array | None = None
    crushing: Bools | None = None


@dataclass(frozen=True)
class Springs:
    """Springs between the two sides of contacts: u + E r + shift takes the place of u, in both parts of the law.

    Attributes
    ----------
    compliance : (n, 3) diagonal of E, zero where a contact has no springs [1/kg]
    shift : (n, 2) shift of u_T; that of u_N is the bias [m/s]
    """

    compliance: Array
    shift: Array


@dataclass(frozen=True)
class Terms:
    """A law as shift and cone.

    Attributes
    ----------
    bias : (n,) shift of u_N [m/s]; infinite where the contact must not act in this step
    friction : (n,) μ [-]
    cohesion : (n,) k, tangential impulse carried at r̃_N = 0 [N s]
    adhesion : (n,) s, largest tensile impulse; r̃_N = r_N + s [N s]
    springs : of joints that yield; None where none does
    """

    bias: Array
    friction: Array
    cohesion: Array
    adhesion: Array
    springs: Springs | None = None


class Joint(Protocol):
    """Members of a law of joints without bond and springs; laws inherit them and say what they have."""

    @property
    def bonded(self) -> bool:
        """True where it bonds stones that meet as the run, or a stage of building, begins."""
        return False

    @property
    def sprung(self) -> bool:
        """True where contacts yield by springs."""
        return False

    @property
    def crushes(self) -> bool:
        """True where a pressure is the most that contacts bear."""
        return False

    @property
    def by_thickness(self) -> bool:
        """True where the thickness of the mortar in a joint counts."""
        return False

    @property
    def thickness(self) -> float | None:
        """Thickness of mortar in joints whose own is not known; None if that is not known either [m]."""
        return None

    @property
    def damping_time(self) -> float:
        """Time in which dashpots let springs take over [s]."""
        return 0.0

    @property
    def normal_stiffness(self) -> float | None:
        """Stiffness across the joint, per area; None where it has none, or not one for all joints [Pa/m]."""
        return None

    @property
    def softening(self) -> float:
        """Shortest displacement over which a bond is lost; infinite where none softens [m]."""
        return math.inf

    @property
    def reach(self) -> float:
        """Gap up to which the law acts, so that contacts are watched beyond the alert distance [m]."""
        return 0.0

    def crushing(self, contacts: Approach, impulse: Array | None = None) -> Bools:
        """Return the contacts (n,) whose pressure exceeds the strength of the joint in a step with r̃ (n, d) [N s].

        Before its solution is known, those that are at their strength and close further are.
        """
        return np.zeros(len(contacts.gap), dtype=bool)

    def without_bond(self, parted: bool) -> "Law":
        """Return the law of a joint whose bond has broken; one that has `parted` has lost its mortar too."""
        return cast("Law", self)


class Law(Joint, Protocol):
    """A contact law: a frozen dataclass of its parameters, checked on construction (SceneError)."""

    @property
    def friction(self) -> float:
        """Coulomb's μ of a contact that sticks [-]."""

    def terms(self, contacts: Approach) -> Terms:
        """State the law for one step."""

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return new internal variables (n, STATE), from the shifted impulses r̃ (n, d) [N s] and u (n, d) [m/s].

        Solvers end with an exact local solution: r̃_N = 0 where a contact opened, ‖r_T‖ on the cone where it slid.
        """
