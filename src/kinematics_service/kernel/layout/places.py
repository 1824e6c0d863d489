# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define the indices into the kernel's arrays, the codes that the kernel returns, and shared
constants.

The build (`packaging/kernel_types.py`) makes each of these numbers a compile-time constant.
"""

import math

# Number of poses that the kernel evaluates at once. Arrays for these poses are interleaved: first
# the first number of each pose, then the second number of each pose, and so on. The index of a
# pose in this order, 0 to 15, is called the lane of the pose.
LANES = 16

# Forms of a chain. The kernel has different code for each form. A chain consists of elements,
# which are screw motions about z. An entry is a pair: an element, and a joint that moves the
# element (`ChainTable`). MIXED: the joint of entry k is not always joint k. PLAIN: the joint of
# entry k is joint k. TWISTED: the joint of entry k is joint k, each element has exactly one entry,
# and the transform between two elements is Rx(alpha) Tx(a). CLOSED: passive variables of closed
# loops move some elements.
MIXED, PLAIN, TWISTED, CLOSED = range(4)

# Limits on the size of closed loops. The kernel stores the values that describe the loops in
# arrays of fixed size.
MAX_LOOP_ENTRIES = 32  # largest number of entries in each of the two chains of a loop
MAX_LOOP_ROWS = 18  # largest number of residual components in one group of loops
MAX_PASSIVE_VARIABLES = 24
MAX_LOOP_JOINTS = 128  # largest number of joints of an arm with loops
# Largest number of joints n of an arm whose singular poses are searched. The list of singular
# poses (the atlas) takes n^4 operations: one core needs 1 s for 16 joints, 4 s for 20 and hours
# for 128.
MAX_SEARCHED_JOINTS = 16

# `evaluate` fills a row of numbers for each pose. These are the indices in the row at which the
# pose, the quaternion and the Jacobian begin.
POSE_AT = 0
QUATERNION_AT = 16
JACOBIAN_AT = 20

# Depths of `evaluate`. The depth selects how much of a row of results is filled. Each depth
# includes the previous depths.
POSE, JACOBIAN, ALL_FRAMES = range(3)

# A row of results of one pose ends with q (n,), qdot (n,) and a copy of the quaternion. ROW_TAIL
# is the length of this copy. The sign of the copy may differ from that of the quaternion at
# QUATERNION_AT.
ROW_TAIL = 4

# Indices in a row of singularity measures. Six scalars come first: DETERMINANT to RANK. At index
# LOST_AT, lost_direction (6,) begins. Then follow joint_motion (n,), way_out (n,) and the singular
# values.
(
    DETERMINANT,
    MANIPULABILITY,
    CONDITION_NUMBER,
    SMALLEST_SINGULAR_VALUE,
    DISTANCE,
    RANK,
    LOST_AT,
) = range(7)

# Indices in a row of singularity measures, counted from the first number after the singular
# values. At index WATCHED is the measure that is compared with the thresholds. At LEVEL is the
# result of the comparison, without hysteresis: 0 for OK, 1 for WARN, 2 for ERROR. At
# NEAREST_FACTOR is the number of the singular factor nearest to zero. At FIRST_ORDER is the
# first-order distance to a singular pose, rad. At JUDGED begin the distances to the zeros of the
# singular factors, rad. Then follow the value and gradient of each factor. Last comes the nearest
# singular pose (n,), NaN if none was found.
WATCHED, LEVEL, NEAREST_FACTOR, FIRST_ORDER, JUDGED = range(5)

# The joint memory stores the times at which the reported position of a joint jumped. For each
# joint it keeps the times of this many latest jumps.
JUMPS_KEPT = 16

# Sources of joint velocities. AUTO takes the velocities of the message, or differences of
# positions if the message has no velocities.
AUTO, FROM_MESSAGE, FROM_DIFFERENCE = range(3)

# Result codes of `observe`, which stores one message. The first three codes mean that a new tool
# state was computed. The other codes are reasons why no tool state was computed.
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

# If the stamp stepped back by more than the timeout, `observe` adds this number to the result
# code.
STARTED_ANEW = 16

# Result of `observe_bytes` if the bytes do not have the expected byte layout. Then no joint
# position is stored.
NOT_THIS_FORM = -1

# Largest number of seconds in the stamp of a message: int32.
LARGEST_SECOND = 2**31 - 1
# A time in ns that is later than all stamps, because the seconds of a stamp are an int32.
LARGEST_STAMP = 2**62

# Operations in a tape, the list of operations that computes a singular factor (robot/factors.py).
# The operands of an operation are results of earlier operations, or a joint position.
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

# Kinds of closed forms that `inverse_candidates` solves (kinematics/inverse/problem/plan.py).
POSITION_3, SPHERICAL_WRIST, PARALLEL_AXES = range(3)

# Number of candidate solutions that arrays for one target can hold. The number is twice 16, the
# largest number of solutions of six joints. A closed form has at most 4 * 2 * 2 = 16 candidates: 4
# positions of joint 3, for each of them 2 positions of joint 2, and for each of these pairs 2
# positions of the wrist.
MAX_CANDIDATES = 32

# Results of `take_target`, which checks a target of inverse kinematics.
FINE, NOT_FINE, NOT_RIGID, ROUGH = range(4)

# Largest numbers of Levenberg-Marquardt steps. MAX_SEARCH_STEPS is for a start at any joint
# positions, MAX_CANDIDATE_STEPS for a start at a candidate solution.
MAX_SEARCH_STEPS = 80
MAX_CANDIDATE_STEPS = 40

# Largest angle, rad, for which the kernel computes sine and cosine by its own code. Up to this
# angle, the number of quarter turns has 17 bits, so its product with HALF_PI_1 or HALF_PI_2 (33
# bits, chain_pass.py) is exact.
LARGEST_REDUCED = 1e5
# Radius of the search for singular poses, rad (prismatic joints divided by the characteristic
# length). If no singular pose was found, this radius is reported as the distance. A clearance is
# computed from bounds of the derivatives of J_t, which hold within this radius around the joint
# positions.
FARTHEST = 1.0
# For the rank of J_t and the distance to a singular pose, a singular value of J_t is taken as zero
# if it is below this multiple of the largest singular value. The round-off of J is about 1e-15.
# The reference data of the tests use the tolerance 1e-10, too.
RANK_TOLERANCE = 1e-10
# A pose is taken as singular if a singular value of J_t is below this multiple of the largest
# singular value. Two computations use this ratio: the search for singular poses, and the
# computation of clearances. The ratio is not 0, because rounded lengths make singular values
# nonzero.
SINGULAR_VALUE_RATIO = 1e-7
# A pose is nearly singular if the condition number of the task Jacobian J_t exceeds this, even if
# no singular pose was found. The ratio of the smallest to the largest singular value is then below
# 1e-4. In an arm of 1 m, joint errors of 0.1 mrad change this ratio by about 1e-4. So within these
# errors the pose may be singular.
NEARLY_SINGULAR = 1e4
# Largest joint position or velocity that the kernel accepts. At 1e15 rad the spacing of doubles is
# 0.125 rad.
LARGEST = 1e15
# A joint position is taken as inside its limits if it exceeds a limit by at most this, rad or m.
# The tolerance covers the round-off of a solution.
AT_LIMIT = 1e-9
# Initial damping of Levenberg-Marquardt if the start is not near a solution.
SEARCH_DAMPING = 1e-3
# Two solutions of inverse kinematics are taken as one if the distance between their joint
# positions (rad, prismatic joints scaled) is below this.
SOLUTION_TOLERANCE = 1e-8
PI = math.pi
TAU = math.tau
NAN, INFINITY = math.nan, math.inf
