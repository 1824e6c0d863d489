"""
Indices into the kernel's arrays, codes that it returns, and constants that several files share.

The build turns them into constants of the compiler (`packaging/kernel_types.py`).
"""

import math

# Number of poses of a batch that are evaluated together, one in each lane.
LANES = 16

# Forms of a chain.
# MIXED: entries and joints differ. PLAIN: entry k is joint k. TWISTED: as PLAIN, and each joint
# has its own element, and the motion between two elements is Rx(alpha) Tx(a). CLOSED: passive
# variables of closed loops move some entries.
MIXED, PLAIN, TWISTED, CLOSED = range(4)

# Limits of closed loops, for arrays of fixed size.
MAX_LOOP_ENTRIES = 32  # entries of each of the two chains of a loop
MAX_LOOP_ROWS = 18  # components of the loops of one group
MAX_PASSIVE_VARIABLES = 24
MAX_LOOP_JOINTS = 128  # joints of an arm with loops
# Largest number of joints for which the kernel searches singular poses. Building the atlas of an
# arm takes n^4 operations: 1 s on one core for 16 joints, 4 s for 20 and hours for 128.
MAX_SEARCHED_JOINTS = 16

# Indices in a row of results.
POSE_AT = 0
QUATERNION_AT = 16
JACOBIAN_AT = 20

# Depths of `evaluate`: the parts of a row that it fills. Each depth includes those before it.
POSE, JACOBIAN, ALL_FRAMES = range(3)

# The row of one pose ends with q (n), qdot (n) and a copy of the quaternion with any sign.
ROW_TAIL = 4

# Indices in a row of measures: six scalars, then lost_direction (6), joint_motion (n), way_out (n)
# and the singular values.
(
    DETERMINANT,
    MANIPULABILITY,
    CONDITION_NUMBER,
    SMALLEST_SINGULAR_VALUE,
    DISTANCE,
    RANK,
    LOST_AT,
) = range(7)

# Indices after the singular values of a row of measures: the watched measure, its level without
# hysteresis, the index of the factor nearest to zero, and the first-order distance. JUDGED is the
# number of these. The distances of the factors in rad, value and gradient of each factor, and the
# nearest singular pose (n) come next; NaN if none was found.
WATCHED, LEVEL, NEAREST_FACTOR, FIRST_ORDER, JUDGED = range(5)

# Number of the latest jumps of a joint whose times are stored.
JUMPS_KEPT = 16

# Sources of velocities. AUTO: the message, or differences of positions if it has no velocities.
AUTO, FROM_MESSAGE, FROM_DIFFERENCE = range(3)

# Results of `observe`.
(
    WITHOUT_VELOCITIES,
    WITH_VELOCITIES,
    WITH_DIFFERENCES,
    BAD_POSITION,
    NOT_NEWER,
    INCOMPLETE,
    NOT_COMPUTABLE,
    NOT_CLOSED,
) = range(8)

# `observe` adds this to its result if the message begins a new time.
STARTED_ANEW = 16

# Result of `observe_bytes` for bytes of another form: it has changed nothing.
NOT_THIS_FORM = -1

# Largest number of seconds in the stamp of a message: int32.
LARGEST_SECOND = 2**31 - 1
# A time in ns that no stamp with an int32 of seconds reaches.
LARGEST_STAMP = 2**62

# Operations of a factor's tape (robot/factors.py). Their operands are earlier steps, or a joint.
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

# Closed forms of `inverse_candidates` (kinematics/inverse/problem/plan.py).
POSITION_3, SPHERICAL_WRIST, PARALLEL_AXES = range(3)

# Largest number of candidates: 2 x 4 of three joints, doubled by a wrist.
MOST_CANDIDATES = 32

# Results of `take_target`.
FINE, NOT_FINE, NOT_RIGID, ROUGH = range(4)

# Largest number of steps of a refinement that starts at any posture, and at a candidate.
MAX_SEARCH_STEPS = 80
MAX_CANDIDATE_STEPS = 40

# Largest angle in rad that the kernel's own sine reduces: the number of its quarter turns has 17
# bits, so its product with a part of pi/2 is exact.
LARGEST_REDUCED = 1e5
# Radius of the search for singular poses, rad (prismatic joints divided by the length). A distance
# of this value means that none was found. The bounds of a clearance hold within this radius.
FARTHEST = 1.0
# Singular values below this multiple of the largest one count as zero (rank, distance). Round-off
# of J is about 1e-15; the golden data has the same tolerance.
RANK_TOLERANCE = 1e-10
# A pose is singular if its vanishing singular values are below this multiple of the largest one:
# they are not exactly zero if lengths are rounded. The search and the clearance share it.
SINGULAR_VALUE_RATIO = 1e-7
# Condition number above which a pose is nearly singular, even if no singular pose was found: an
# arm of 1 m with joint errors of 0.1 mrad cannot distinguish it from a singular pose.
NEARLY_SINGULAR = 1e4
# Largest position or velocity that the kernel accepts. At 1e15 rad the spacing of doubles is an
# eighth of a turn.
LARGEST = 1e15
# A position beyond a limit by at most this is at the limit (rad, m): round-off of a solution.
AT_LIMIT = 1e-9
# Initial damping of a refinement that starts at any posture.
SEARCH_DAMPING = 1e-3
# Solutions within this distance (rad, scaled) are the same solution.
SOLUTION_TOLERANCE = 1e-8
PI = math.pi
TAU = math.tau
NAN, INFINITY = math.nan, math.inf
