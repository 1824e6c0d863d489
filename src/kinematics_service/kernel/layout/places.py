"""
Define indices into the arrays of the kernel, codes that the kernel returns, and shared constants.

The build turns all of them into constants of the compiler (`packaging/kernel_types.py`).
"""

import math

# Number of poses of a batch that are evaluated together, one in each lane.
LANES = 16

# Forms of a chain. An entry is one joint that moves one element (`ChainTable`).
# MIXED: entries and joints differ. PLAIN: entry k belongs to joint k. TWISTED: PLAIN, each joint
# has its own element, and the motion between two elements is Rx(alpha) Tx(a). CLOSED: passive
# variables of closed loops move some entries.
MIXED, PLAIN, TWISTED, CLOSED = range(4)

# Limits of closed loops: the kernel has arrays of fixed size.
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

# Depths of `evaluate`: the parts of a row that it fills. Each depth includes the previous depths.
POSE, JACOBIAN, ALL_FRAMES = range(3)

# Length of the quaternion at the end of the row of one pose: q (n,), qdot (n,), and a copy of the
# quaternion, whose sign may differ.
ROW_TAIL = 4

# Indices in a row of measures: six scalars, then lost_direction (6,), joint_motion (n,),
# way_out (n,) and the singular values.
(
    DETERMINANT,
    MANIPULABILITY,
    CONDITION_NUMBER,
    SMALLEST_SINGULAR_VALUE,
    DISTANCE,
    RANK,
    LOST_AT,
) = range(7)

# Indices after the singular values in a row of measures: the watched measure, its level without
# hysteresis, the index of the factor nearest to zero, and the first-order distance. JUDGED is
# their number. After them come the distances of the factors, rad, the value and gradient of each
# factor, and the nearest singular pose (n,), which is NaN if none was found.
WATCHED, LEVEL, NEAREST_FACTOR, FIRST_ORDER, JUDGED = range(5)

# Number of jumps of a joint whose times are stored: the latest ones.
JUMPS_KEPT = 16

# Sources of velocities. AUTO: the message, or differences of positions if the message has no
# velocities.
AUTO, FROM_MESSAGE, FROM_DIFFERENCE = range(3)

# Results of `observe`, which takes one message.
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

# `observe` adds this to its result if the stamp stepped back by more than the timeout.
STARTED_ANEW = 16

# Result of `observe_bytes` if the bytes have another form: nothing was changed.
NOT_THIS_FORM = -1

# Largest number of seconds in the stamp of a message: int32.
LARGEST_SECOND = 2**31 - 1
# A time in ns beyond all stamps: their seconds are an int32.
LARGEST_STAMP = 2**62

# Operations of the tape of a singular factor (robot/factors.py). The operands are earlier steps,
# or a joint.
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

# Room for candidates of one target: twice the largest number of solutions of six joints, 16. A
# closed form has at most 2 x 4 candidates of three joints, times 2 of a wrist.
MOST_CANDIDATES = 32

# Results of `take_target`, which checks a target.
FINE, NOT_FINE, NOT_RIGID, ROUGH = range(4)

# Largest number of steps of a refinement that starts at any posture, and of one that starts at a
# candidate.
MAX_SEARCH_STEPS = 80
MAX_CANDIDATE_STEPS = 40

# Largest angle, rad, that the kernel's own sine reduces. The number of quarter turns in the angle
# has 17 bits, so that its product with a part of pi/2 is exact.
LARGEST_REDUCED = 1e5
# Radius of the search for singular poses, rad (prismatic joints divided by the characteristic
# length). A distance of this value means that none was found. The bounds of derivatives for a
# clearance hold within this radius.
FARTHEST = 1.0
# A singular value is taken as zero (rank, distance) if it is below this multiple of the largest
# one. Round-off of J is about 1e-15; the golden data has the same tolerance.
RANK_TOLERANCE = 1e-10
# The search and the clearance take a pose as singular if a singular value is below this multiple
# of the largest one: singular values are not exactly zero if lengths are rounded.
SINGULAR_VALUE_RATIO = 1e-7
# A pose is nearly singular if its condition number exceeds this, even if no singular pose was
# found: an arm of 1 m with joint errors of 0.1 mrad cannot distinguish it from a singular pose.
NEARLY_SINGULAR = 1e4
# Largest position or velocity that the kernel accepts. At 1e15 rad the spacing of doubles is an
# eighth of a turn.
LARGEST = 1e15
# A position beyond a limit by at most this, rad or m, is inside: round-off of a solution.
AT_LIMIT = 1e-9
# Initial damping of a refinement that starts at any posture.
SEARCH_DAMPING = 1e-3
# Two solutions are the same if their distance (rad, scaled) is below this.
SOLUTION_TOLERANCE = 1e-8
PI = math.pi
TAU = math.tau
NAN, INFINITY = math.nan, math.inf
