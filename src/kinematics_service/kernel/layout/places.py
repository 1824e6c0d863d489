"""
Where things stand in the arrays of the kernel, and the numbers that others know of it, too.

The build makes constants of the compiler of them (`packaging/kernel_types.py`).
"""

import math

# Poses of a batch that are evaluated side by side.
LANES = 16

# Forms of a chain: entries and joints differ; entry k is joint k; and each has an element of its
# own, with no more than a turn about x and a step along it up to the next one; and entries that
# move with passive variables of closed loops.
MIXED, PLAIN, TWISTED, CLOSED = range(4)

# Closed loops: entries of each of their two chains, components of those that are solved together,
# passive variables and joints at most.
MOST_LOOP_ENTRIES = 32
MOST_LOOP_ROWS = 18
MOST_PASSIVE = 24
MOST_JOINTS = 128
# Largest number of joints for which nearest singular poses are searched: the atlas of an arm takes
# n^4, 1 s of a core for 16 joints, 4 s for 20 and hours for 128.
MAX_SEARCHED_JOINTS = 16

# Where things stand in a row of results.
POSE_AT = 0
QUATERNION_AT = 16
JACOBIAN_AT = 20

# How much of a row `evaluate` fills: each step includes the ones before it.
POSE, JACOBIAN, ALL_FRAMES = range(3)

# After the q (n) and qdot (n) of a row of one pose: its quaternion once more, with any sign.
ROW_TAIL = 4

# A row of measures: these scalars, then lost_direction (6), joint_motion (n), way_out (n), sigma.
(
    DETERMINANT,
    MANIPULABILITY,
    CONDITION_NUMBER,
    SMALLEST_SINGULAR_VALUE,
    DISTANCE,
    RANK,
    LOST_AT,
) = range(7)

# After the singular values, where thresholds and factors are known: the watched measure, its level
# without hysteresis, the factor nearest to its zero, the distance by first order; the distances of
# the factors in rad; value and gradient of each; the singular pose that was found (n), NaN where
# none was.
WATCHED, LEVEL, NEAREST, FIRST_ORDER, JUDGED = range(5)

# Jumps of a joint whose times are remembered.
JUMPS_KEPT = 16

# Where velocities come from: the message or else differences, the message only, differences only.
AUTO, FROM_MESSAGE, FROM_DIFFERENCE = range(3)

# What `observe` says of a message.
(
    SAID_WITHOUT_VELOCITIES,
    SAID_WITH_VELOCITIES,
    SAID_WITH_DIFFERENCES,
    BAD_POSITION,
    NOT_NEWER,
    INCOMPLETE,
    NOT_COMPUTABLE,
    NOT_CLOSED,
) = range(8)

# Added to it where the message was a new start.
STARTED_ANEW = 16

# What `observe_bytes` says of bytes it does not know: nothing was done.
NOT_THIS_FORM = -1

# What a stamp's seconds can hold in a message: int32.
LARGEST_SECOND = 2**31 - 1
# Beyond all stamps that an int32 of seconds can make, ns.
LARGEST_STAMP = 2**62

# Operations of a factor's tape (robot/factors.py): operands are earlier steps, or a joint.
(
    CONSTANT,
    JOINT,
    SUM,
    DIFFERENCE,
    PRODUCT,
    QUOTIENT,
    NEGATIVE,
    SINE,
    COSINE,
    SQUARE_ROOT,
    ARC_TANGENT,
) = range(11)

# Ways to the candidates (kinematics/inverse/problem/plan.py): asked of `inverse_candidates`.
POSITION_3, SPHERICAL_WRIST, PARALLEL_AXES = range(3)

# Most candidates there can be: 2 x 4 of three joints, doubled by a wrist.
MOST_CANDIDATES = 32

# What `take_target` says of a target.
FINE, NOT_FINE, NOT_RIGID, ROUGH = range(4)

# Steps at most of a refinement that starts anywhere, and of one that starts at a candidate.
FAR_STEPS = 80
NEAR_STEPS = 40

# Up to here the number of quarter turns has 17 bits, and its product with a part is exact.
LARGEST_REDUCED = 1e5
# Within this of a pose singular ones are looked for (rad; prismatic joints divided by the length):
# as a distance it means at least that. The bounds of a clearance hold within it.
FARTHEST = 1.0
# A singular value below this share of the largest counts as zero (rank, distance).
# Round-off of J is some 1e-15; the golden data uses the same share.
RANK_TOLERANCE = 1e-10
# A pose is singular if the singular values that vanish there are below this share of the largest:
# rounded lengths leave values that are not zero. Search and clearance have the same.
SINGULAR_VALUE_RATIO = 1e-7
# A condition number above which a pose is nearly singular, and warned of, though no singular pose
# was found: an arm of 1 m with joint errors of 0.1 mrad cannot tell it from a singular one.
NEARLY_SINGULAR = 1e4
# At 1e15 rad neighbouring doubles are an eighth of a turn apart: such a number says nothing.
LARGEST = 1e15
# Beyond a limit by less is at the limit: what the last digits of a solution do (rad, m).
AT_LIMIT = 1e-9
# Damping at first of a refinement that starts anywhere.
FAR_DAMPING = 1e-3
# Solutions nearer than this (rad, scaled) are one.
SAME_SOLUTION = 1e-8
PI = math.pi
TAU = math.tau
NAN, INFINITY = math.nan, math.inf
