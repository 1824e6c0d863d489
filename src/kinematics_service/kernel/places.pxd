cdef extern from *:
    """
    #define KINEMATICS_LARGEST_REDUCED 1e5
    #define KINEMATICS_RANK_TOLERANCE 1e-10
    #define KINEMATICS_LARGEST 1e15
    #define KINEMATICS_AT_LIMIT 1e-9
    #define KINEMATICS_FAR_DAMPING 1e-3
    #define KINEMATICS_SAME_SOLUTION 1e-8
    #define KINEMATICS_PI 3.141592653589793
    #define KINEMATICS_TAU 6.283185307179586
    #ifndef KINEMATICS_SOURCE
    #define KINEMATICS_SOURCE ""
    #endif
    #define KINEMATICS_NAN Py_NAN
    #define KINEMATICS_INFINITY Py_HUGE_VAL
    """
    const double LARGEST_REDUCED "KINEMATICS_LARGEST_REDUCED"
    const double RANK_TOLERANCE "KINEMATICS_RANK_TOLERANCE"
    const double LARGEST "KINEMATICS_LARGEST"
    const double AT_LIMIT "KINEMATICS_AT_LIMIT"
    const double FAR_DAMPING "KINEMATICS_FAR_DAMPING"
    const double SAME_SOLUTION "KINEMATICS_SAME_SOLUTION"
    const double PI "KINEMATICS_PI"
    const double TAU "KINEMATICS_TAU"
    const char* SOURCE "KINEMATICS_SOURCE"
    const double NAN "KINEMATICS_NAN"
    const double INFINITY "KINEMATICS_INFINITY"

cdef enum:
    LANES = 16

cdef enum:
    MIXED = 0
    PLAIN
    TWISTED

cdef enum:
    POSE_AT = 0
    QUATERNION_AT = 16
    JACOBIAN_AT = 20

cdef enum:
    POSE = 0
    JACOBIAN
    ALL_FRAMES

cdef enum:
    ROW_TAIL = 4

cdef enum:
    DETERMINANT = 0
    MANIPULABILITY
    CONDITION_NUMBER
    SMALLEST_SINGULAR_VALUE
    DISTANCE
    RANK
    LOST_AT

cdef enum:
    WATCHED = 0
    LEVEL
    NEAREST
    JUDGED

cdef enum:
    JUMPS_KEPT = 16

cdef enum:
    AUTO = 0
    FROM_MESSAGE
    FROM_DIFFERENCE

cdef enum:
    SAID_WITHOUT_VELOCITIES = 0
    SAID_WITH_VELOCITIES
    SAID_WITH_DIFFERENCES
    BAD_POSITION
    NOT_NEWER
    INCOMPLETE
    NOT_COMPUTABLE

cdef enum:
    STARTED_ANEW = 16

cdef enum:
    NOT_THIS_FORM = -1

cdef enum:
    LARGEST_SECOND = 0x7fffffff

cdef enum:
    LARGEST_STAMP = 0x4000000000000000

cdef enum:
    CONSTANT = 0
    JOINT
    SUM
    DIFFERENCE
    PRODUCT
    QUOTIENT
    NEGATIVE
    SINE
    COSINE
    SQUARE_ROOT
    ARC_TANGENT

cdef enum:
    POSITION_3 = 0
    SPHERICAL_WRIST
    PARALLEL_AXES

cdef enum:
    MOST_CANDIDATES = 32

cdef enum:
    AIM_AXES = 16
    AIM_WEIGHTS = 25
    AIM_SIZE = 31

cdef enum:
    FINE = 0
    NOT_FINE
    NOT_RIGID
    ROUGH

cdef enum:
    MISSES = 0
    MARGIN
    SHARE
    BEYOND_AT

cdef enum:
    LARGEST_DAMPING = 0
    DAMPED_BELOW
    LENGTH
    HORIZON

cdef enum:
    DAMPING = 0
    LEAST_SINGULAR_VALUE
    SHORTENED
    SLOWEST

cdef enum:
    FAR_STEPS = 80
    NEAR_STEPS = 40
