"""What the tables of the reference say in words: one sentence for each name of the code."""

HEARD_TOPICS = {
    'joint_states': 'the joints of the arm, by name; every message that is accepted is answered',
    '~/target_pose': 'a pose to reach; answered on `~/ik/joint_states` and `~/ik/solutions`',
    '~/target_twist': 'a twist to follow; answered on `~/ik/joint_velocity`',
    '~/command': 'joint velocities that are asked for, by name; each is answered on `~/scale`',
    '~/reference_pose': "the tool's pose from elsewhere, compared in the status `frames` on "
    '`/diagnostics`',
}

TOPICS = {
    '~/pose': 'tool in the base frame; unit quaternion, its sign continuous over time',
    '~/jacobian': '6 x n, row-major; `dim[0]` has the label `vx,vy,vz,wx,wy,wz`, `dim[1]` the '
    'joint names; its stamp is on `~/jacobian/stamp`',
    '~/jacobian/stamp': 'stamp of the joint state of each Jacobian, sent right after it: '
    '[how to pair them](../how_to/quality_of_service.md#a-subscriber-of-your-own)',
    '~/twist': 'J qdot; `frame_id` is the frame whose axes are used',
    '~/velocity': 'the same with body, reference and axes named',
    '~/acceleration': 'J qddot + dJ/dt qdot in the axes of the twist; of velocities that messages '
    'report, half of `acceleration_window` late; none of differences of positions',
    '~/wrench': 'force and torque that the tool exerts, J^T w = efforts, at the origin and in the '
    'axes of `frame_id`, the tool; not external before `~/wrench/zero`; none while an effort is '
    'not known',
    '~/pose_with_covariance': 'the pose, and how far it may be off: rows and columns x y z, then '
    'rotations about x y z of the base frame; offered where the robot file has `uncertainty`',
    '~/twist_with_covariance': 'the twist, and how far it may be off, in the same axes; offered '
    'where the robot file has `uncertainty` with `velocity_noise`',
    '~/null_space': "orthonormal basis of the joint motions that leave the task's rows at rest, "
    'n x k, row-major; `dim[0]` has the joint names; continuous from message to message; offered '
    'where the arm has self-motion',
    '~/null_space/away': 'the self-motion that raises the distance fastest, its gradient in the '
    'null space, a number for each joint; zeros where no singular pose was found within 1 rad',
    '~/singularity/clearance': 'radius in which no pose is singular, proved, rad; costs nothing '
    'unheard',
    '~/link_frames': 'every frame of the table in the base frame',
    '~/markers': 'links, joint axes, velocity ellipsoid, twist, lost direction, level and '
    'distance for RViz and Foxglove; at most thirty a second',
    'robot_description': 'with `publish_robot_description`: a URDF made from the table',
    '/tf': 'with `publish_tf`, where tf2_msgs is installed: the tool in the base frame',
    '~/singularity/warning': 'OK, WARN, ERROR or STALE, a sentence, key-values; a node that '
    'starts late gets the last one',
    '~/ik/joint_states': 'for a target pose: the solution nearest to the present joint positions, '
    'or of a redundant arm what `ik.redundancy` says',
    '~/ik/solutions': 'for a target pose: the solutions inside the limits, solutions x joints, '
    'nearest first; `dim[0]` labels their postures, `dim[1]` the joint names',
    '~/ik/joint_velocity': 'for a target twist: joint velocities by damped least squares, inside '
    'every limit',
    '~/ik/status': 'one for each target that is not replaced by a newer one (`replaced` is their '
    'number): OK, WARN (a twist is followed in part), ERROR (refused, '
    'unreachable) and the reason; where `ik.redundancy` is not `near`, the arc of postures and '
    'its ends',
    '~/scale': 'for a command: the share of it that may be kept now, 0 to 1; it falls at once and '
    'rises by `scale.rise`; 0 where the joint positions are not known; no safety function',
    '~/scale_reason': 'when it changes: OK, WARN (slowed), ERROR (stopped) or STALE (refused), '
    'and the cause with joint or point, margin and time left; a node that starts late gets the '
    'last one',
    '~/servo_status': 'the same as a code of MoveIt Servo: 0 nothing, 1 slowed and 2 stopped '
    'before a singularity, 3 slowed on the way out (by its own rule alone), 6 a limit of '
    'position, -1 refused',
    '/diagnostics': 'once a second: input rate, age, messages by what became of them, missing '
    'joints, publishers; beside it `frames`, `parameters` and `wrench`, where there is something '
    'to say of them',
}

_XYZ = 'position'
_RPY = 'orientation: R = Rz(yaw) Ry(pitch) Rx(roll)'

# Class of the schema: heading, a sentence, and the meaning of each key.
ROBOT_FILE = {
    'RobotEntry': (
        'The file',
        'One file is one arm. A number may be an expression of `pi`, the constants, '
        '`+ - * / ( )`, `sqrt`, `sin`, `cos` and `atan2`.',
        {
            'robot': 'name of the arm',
            'source': 'where the numbers come from: datasheet, page, drawing',
            'convention': 'which table `links` holds',
            'units': 'units of every number of the file',
            'constants': 'names for numbers: `{L1: 0.12, L2: 0.4}`; `L1:` without a value is a '
            'letter, for `check`, `derive` and `compare`',
            'joints': "the actuated joints, in the order of the Jacobian's columns",
            'links': 'the rows of the table, base to tool',
            'base': 'where the table begins, in the base frame',
            'tool': 'the tool, in the last frame of the table',
            'points': 'other points of the arm, by name: `{elbow: {row: 2}}`',
            'loops': 'closed loops, whose passive joints follow the others',
            'singularity': 'what is called singular, and when to warn',
            'speed_limits': 'largest speeds of the tool and of points, for `ks.scale`',
            'uncertainty': 'how far joints and table may be off',
            'known_poses': 'poses known from elsewhere, which `check` compares',
            'tolerance': 'how far the numbers of the table may be off, for `calibrate`',
        },
    ),
    'UnitsEntry': (
        'units',
        'Without this key the file is in rad and m.',
        {'angle': 'unit of angles', 'length': 'unit of lengths'},
    ),
    'JointEntry': (
        'joints',
        'A joint without `limits` turns without end.',
        {
            'name': 'as the driver publishes it in `joint_states`',
            'variable': 'what the table calls it; without it the name',
            'type': '`revolute` stands in `theta`, `prismatic` in `d`, `helical` in both',
            'limits': 'range of the joint, `[lower, upper]`',
            'velocity': 'largest speed, a second',
            'acceleration': 'how fast the joint can be stopped, a second squared',
            'unused': 'the joint stands in no row of the table, on purpose',
        },
    ),
    'DhRowEntry': (
        'links, standard and modified',
        '`theta` and `d` may be any expression that is linear in the joint variables. So signs, '
        'offsets, gears and coupled joints need no keyword. In `elementary` a row is one text '
        'instead, such as `Rz(q1)` or `Tx(L1)`, of `Rx Ry Rz Tx Ty Tz`.',
        {
            'a': 'distance of the joint axes along x',
            'alpha': 'angle of the joint axes about x',
            'd': 'distance along z; a prismatic joint moves it',
            'theta': 'angle about z; a revolute joint moves it',
        },
    ),
    'ShapeRowEntry': (
        'links, shape',
        'A row is in * joint * inverse(out), after Sheth and Uicker. A matrix has 3 or 4 rows of '
        '4 numbers, or is `{xyz, rpy}`; left out it is the identity.',
        {
            'in': 'shape matrix on the side of the link before',
            'joint': 'one of `Rx() ... Tz()` with the joint variable',
            'out': 'shape matrix on the side of the link after',
        },
    ),
    'PlacementEntry': (
        'base and tool',
        'What is left out is zero, and the frames are called `base_link` and `tool0`.',
        {'frame': 'name of the frame in ROS', 'xyz': _XYZ, 'rpy': _RPY},
    ),
    'PointEntry': (
        'points',
        'A mapping of names to points. A name may be part of a topic, `~/elbow/pose`. The `tool` '
        'is always a point, and has a key of its own. A point that is written to a URDF is a link '
        'there, and `import --point` reads it back.',
        {
            'row': 'the frame that the point moves with, counted as `link_frames` does: 0 is the '
            "table's frame 0, i the frame after row i",
            'xyz': _XYZ + ' in that frame',
            'rpy': _RPY,
        },
    ),
    'LoopEntry': (
        'loops',
        'A list of closed loops. Each is a second chain that parts from the table and meets it '
        'again. Its passive joints have no motor, and may stand in rows like joints. They follow '
        "from the joints by Newton's method, on the branch of the known position. A loop may use "
        'the passive joints of the loops before it, and of the next ones where these need its '
        'own. Messages have the joints only.',
        {
            'name': 'what messages call it',
            'passive': 'names of the joints that it moves, as many as `rows`; revolute, or as '
            '`{name, type}`',
            'from': "where the second chain begins: without it the table's frame 0",
            'links': 'its rows, in the convention of the table',
            'meets': 'the frame that its end coincides with, moved by the rows of the table',
            'rows': 'which components coincide, of x y z rx ry rz, in the axes of `from`; of a '
            'rotation all three, or those of a loop whose other axes are always parallel',
            'assembled': 'a position at which the loop closes, or nearly: it says which branch is '
            'meant, and is checked',
        },
    ),
    'PassiveEntry': (
        'loops[].passive[]',
        'A joint without a motor. Its limits are those of its loop.',
        {'name': 'in expressions', 'type': '`revolute` where it is left out'},
    ),
    'LoopEndEntry': (
        'loops[].from, loops[].meets',
        'A frame of the table, moved, or a point of the file.',
        {
            'row': 'the frame after this row, 0 for frame 0',
            'point': 'the name of a point, instead of the others',
            'xyz': _XYZ + ' in that frame',
            'rpy': _RPY,
        },
    ),
    'SingularityEntry': (
        'singularity',
        'All of it may be left out.',
        {
            'task': 'rows of J that count, of `x y z rx ry rz`; without it those the arm can move',
            'length': 'the characteristic length; without it the RMS reach',
            'measure': 'measure the warning watches; without it `distance`, above 16 joints '
            '`condition_number`',
            'warn': "WARN beyond it; without it the measure's default; at most 1 rad of "
            '`distance`',
            'stop': 'ERROR beyond it; likewise',
            'factors': 'the named singular factors, which `derive --write` stores',
        },
    ),
    'FactorEntry': (
        'singularity.factors',
        'A list.',
        {
            'name': 'what the warning calls it',
            'expression': 'a function of the joints whose zeros are singular poses',
            'approximate': '`true` if it is that of a table without corrections: it names what is '
            'near and is not counted on for distances',
        },
    ),
    'SpeedLimitEntry': (
        'speed_limits',
        'A mapping of `tool` and names of points to their largest speeds, a second: '
        '`ks.scale` keeps to them.',
        {
            'linear': 'of the origin of the tool or point',
            'angular': 'of its frame',
            'reduced': 'of its origin, where the arm has been told to move at reduced speed',
        },
    ),
    'UncertaintyEntry': (
        'uncertainty',
        'Without it the node publishes no covariances. A key for joints takes a list with one '
        'number for each joint: an angle if it turns, a length if it slides. Where all joints '
        'turn or all slide, it also takes one number for all. Deviations are standard deviations. '
        'A width counts as the standard deviation width / sqrt(12). All errors are independent.',
        {
            'encoder_noise': 'deviation of joint positions',
            'encoder_resolution': 'the steps that positions are counted in: a width',
            'backlash': 'the whole play between encoder and joint: a width',
            'velocity_noise': 'deviation of joint velocities, a second',
            'parameters': 'deviations of numbers of the table, by group (`offsets`, `lengths`, '
            '`angles`; `gears`: the shares by which joints move more than they say) or by name as '
            '`calibrate` calls them (`theta2`, `a3`, `gear1`, `base.x`, `tool.rz`); a name counts '
            'for more than its group',
            'covariance': 'instead, as `calibrate` writes it: of their covariance L L^T a row of '
            'L for each, by name',
            'floor': '`{xyz, rpy}`: deviation of each position and rotation that nothing above '
            'explains, as what a fit leaves',
        },
    ),
    'FloorEntry': (
        'uncertainty.floor',
        'Each of them may be left out.',
        {'xyz': 'along each axis', 'rpy': 'about each axis'},
    ),
    'KnownPoseEntry': (
        'known_poses',
        'A list. A pose without `rpy` is compared in its position alone, and one without '
        '`tolerance` to 1e-6 m and rad. Rounded numbers need a `tolerance`; `check` says which.',
        {
            'q': 'joint positions, in the units of the file',
            'xyz': 'where the tool then is',
            'rpy': _RPY,
            'tolerance': '`{xyz, rpy}`: how exact the pose is',
        },
    ),
    'ToleranceEntry': (
        'known_poses.tolerance',
        'Each of them may be left out.',
        {'xyz': 'of the position', 'rpy': 'of the orientation, as an angle'},
    ),
    'TableToleranceEntry': (
        'tolerance',
        'Standard deviations, with which a calibration begins. Each of them may be left out. The '
        'defaults are 1 mm, 0.2 degrees, and a thousandth of a gear ratio.',
        {
            'length': 'of every length of the table',
            'angle': 'of every angle',
            'gear': 'of every gear ratio, as a share of it',
            'of': 'of single numbers, by the names that `calibrate` prints: `{d1: 0.2e-3}`',
        },
    ),
}

# The subjects of the library by the room their functions live in, in the order of need.
LIBRARY = {
    'robot': 'Robots',
    'kinematics': 'Kinematics and singularities',
    'apps.formulas': 'Formulas',
    'robot.urdf': 'URDF',
    'apps.calibration': 'Calibration and frames',
    'apps.checking': 'Calibration and frames',
    'apps.recordings': 'Calibration and frames',
    'apps.calibration.pose_covariance': 'Kinematics and singularities',
    'apps.recordings.family_paths': 'Kinematics and singularities',
    'apps.recordings.plans': 'Kinematics and singularities',
}
