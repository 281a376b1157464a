"""Numbers that several methods share."""

ROUNDING = 1e-9
"""Part of a quantity that counts as nothing: below it, rounding and the methods' own errors decide [-]."""

CORRECTIONS = 5
"""Corrections with the same factors, at most: each costs a substitution, a twentieth of a factorisation."""

HELD = 1e-4
"""Compliance of a rigid joint in the first step of Newton's method, over the scale of W [-]."""

JOINTS = 1.0, 1e-2, 1e-4, 1e-6
"""Compliances of joints over W_αα, in turn, each a hundredth of the one before: from joints so soft that there is one
state only, to two that are next to rigid [-]."""

MANY = 1000
"""Bodies, and contacts of disks, from which factors no longer stay in the fastest memory."""

LOOK = 5
"""Iterations or sweeps between two measurements of η, at least; ADMM waits for as large a part of those so far."""

PLAIN_LOOK = 20
"""Plain sweeps or iterations over disks between two measurements of η: a measurement costs two sweeps."""

FOLLOWING = 0.1
"""Penalty of ADMM for forces that follow those of the step before, over the mean diagonal of W_αα [-]."""

OVERSHOOT = 1.6
"""Over-relaxation of ADMM (Boyd et al. 2011, section 3.4.3, recommend 1.5 to 1.8) [-]."""

SPARE = 0.2
"""Zeros that a panel of factors of bodies may hold, over its other blocks [-]."""
