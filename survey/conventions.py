"""Conventions of all rooms, each said once: what is beyond chance, most of a whole, alike, small or rounding.

Compiled kernels hold them: after a change, remove `__pycache__/*.nbi`, by which numba knows its caches.
"""

import math
from statistics import NormalDist

from ground.units import CENTI, DECI, KILO, MILLI

# chance
RARE = MILLI  # probability with which what is sound is rejected: Baarda's α₀
TAIL = 0.025  # probability beyond either end of a two-sided interval of 95 %
CRITICAL = -NormalDist().inv_cdf(
    0.5 * RARE
)  # standard deviations that a sound residual exceeds so rarely: 3.29
NOTICEABLE = 2.0  # standard deviations that chance exceeds once in 20 cases
SIGNIFICANT = 3.0  # and once in 400 cases
CERTAIN = 4.0  # and once in 16,000 cases
GROSS = 6.0  # and beyond which a value is wrong, however values are distributed
ODDS = 2.0 * math.log(
    20.0
)  # difference of sums of squares at which one explanation is 20 times likelier than another
TUKEY = 4.685  # scale of Tukey's weights [standard deviations]: 95 % efficiency if the scatter is normal

# shares of a whole [-]
PER_MILLE = MILLI  # up to which a value is right
PER_CENT = CENTI  # from which a difference is worth telling
NEGLIGIBLE = 0.02  # of no account
FEW = 0.05  # exceptions
TENTH = DECI  # up to which a value is nearly right
SOME = 0.25  # from which a part counts
MOST = 0.5
LARGELY = 0.7  # clearly more than half
NEARLY = 0.8  # not quite all

# counts
CORNERS = 3  # of a polygon, and points of a plane
GROUP = 3  # like things that are not one or two that are odd
CHECKED = 4  # points of which three define a plane or a similarity, and one checks it
BESIDE = 4  # stones of a course beside one stone or a gap that tell its bed and its length
ENOUGH = 5  # values that have a median and a scatter: with fewer, it is uncertain by half
SAMPLE = 12  # values from which what is usual is known: their scatter to a fifth
PLACES = 24  # places along a line, or directions, at which something is looked for
LARGEST = 12  # things of a list, the largest first, that a reader takes in
ATTEMPTS = 12  # attempts at most, of what succeeds in the first or second as a rule
MANY = 30  # values of which a single one hardly matters: their scatter is known to an eighth
TRIALS = 300  # random trials, or first stones of a survey: shares are known to 3 %
LISTED = 6  # names in a message
ROUNDS = 4  # rounds that settle what a first one has changed
MAX_ROUNDS = 10  # rounds at most, of what settles in two or three
MAX_ITERATIONS = 100  # iterations at most, of what converges in a dozen
ROWS = 2_000_000  # numbers worked on at a time: 16 MB

# angles [rad]
LEVEL = math.radians(2.0)  # to which stones are cut level, plumb and parallel
SLOPED = 2.5 * LEVEL  # from which a side is meant to slope
PARALLEL = math.radians(10.0)  # between sides that continue each other
ALIKE = math.radians(20.0)  # between faces that are one, or opposite
ONE_WAY = math.radians(30.0)  # between faces of one wall
STEEPEST = math.radians(60.0)  # beyond which a face is another side of the stone

# lengths [m]
FARTHEST = KILO  # from a wall, that somebody measures it
THINNEST = CENTI * MILLI  # of what is drawn or computed: less is no thickness
FINEST = DECI * MILLI  # better than any instrument measures a face of stone
LEAST = MILLI  # a millimetre, in which masons and surveyors count
JOINT = CENTI  # usual width of a joint, and roughness of a face that is not dressed
STEP = 0.02  # height of a step that is a joint, between beds that run through
WEAR = 0.03  # depth of worn edges and of eroded mortar
WIDEST_JOINT = 0.05
BROKEN = DECI  # length of what breaks off a corner, and of a bevel
SMALL_STONE = 0.15  # length of a small stone
STONE = 0.5  # length of a usual stone

# rounding of lengths [m]
TOUCHING = MILLI * MILLI  # distance of faces that meet
ON_PLANE = 1e-8  # distance of corners from a plane that was computed
ROUNDING = 1e-10  # distance of corners from the planes that made them

# rounding of what has no unit, and of lengths over a size [-]
SAME = MILLI * MILLI  # of volumes and angles that are the same
FLAT = DECI * MILLI  # warp, over its size, of what is plane and rounded to a few digits
VANISHING = 1e-9  # of what is nothing
EPSILON = 1e-12  # of the last step of an iteration that has converged
