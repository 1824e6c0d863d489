# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the tables of the reference say in words: one sentence for each name of the code."""

HEARD_TOPICS = {
    'joint_states': 'the joints of the arm, by name; every message that is accepted is answered',
    '~/target_pose': 'a pose to reach; answered on `~/ik/joint_states` and `~/ik/solutions`',
    '~/target_twist': 'a twist to follow; answered on `~/ik/joint_velocity`',
    '~/command': 'commanded joint velocities, by name; each is answered on `~/scale`',
    '~/reference_pose': "the tool's pose from another source, compared in the status `frames` on "
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
    '~/acceleration': 'J qddot + dJ/dt qdot in the axes of the twist; needs reported velocities, '
    'lags by half of `acceleration_window`',
    '~/wrench': 'force and torque that the tool exerts, J^T w = efforts, at the origin and in '
    'the axes of `frame_id`, the tool; external only after `~/wrench/zero`; needs the efforts of '
    'all joints',
    '~/pose_with_covariance': 'the pose and its covariance: rows and columns x y z, then '
    'rotations about x y z of the base frame; exists if the robot file has `uncertainty`',
    '~/twist_with_covariance': 'the twist and its covariance, in the same axes; exists if the '
    'robot file has `uncertainty` with `velocity_noise`',
    '~/null_space': "orthonormal basis of the joint motions that do not move the task's rows, n "
    'x k, row-major; `dim[0]` has the joint names; continuous from message to message; exists if '
    'the arm has self-motion',
    '~/null_space/away': 'the self-motion that raises the distance fastest: its gradient in the '
    'null space, a number for each joint; zeros if no singular pose was found within 1 rad',
    '~/singularity/clearance': 'radius in which no pose is singular, with a proof, rad',
    '~/link_frames': 'every frame of the table in the base frame',
    '~/markers': 'links, joint axes, velocity ellipsoid, twist, lost direction, level and '
    'distance for RViz and Foxglove; at most thirty a second',
    'robot_description': 'with `publish_robot_description`: a URDF made from the table',
    '/tf': 'with `publish_tf`, if tf2_msgs is installed: the tool in the base frame',
    '~/singularity/warning': 'OK, WARN, ERROR or STALE, a sentence, key-values; a late '
    'subscriber gets the last one',
    '~/ik/joint_states': 'for a target pose: the solution nearest to the present joint '
    'positions, or for a redundant arm the posture by `ik.redundancy`',
    '~/ik/solutions': 'for a target pose: the solutions inside the limits, solutions x joints, '
    'nearest first; `dim[0]` has the names of the postures, `dim[1]` the joint names',
    '~/ik/joint_velocity': 'for a target twist: joint velocities by damped least squares, inside '
    'every limit',
    '~/ik/status': 'one for each target that is not replaced by a newer one (`replaced` counts '
    'these): OK, WARN (a twist is followed in part), ERROR (refused, unreachable) and the '
    'reason; unless `ik.redundancy` is `near`, the arc of postures and its ends',
    '~/scale': 'for a command: the factor by which to multiply it now, 0 to 1; it falls at once '
    'and rises by `scale.rise`; 0 if the joint positions are unknown; not a safety function',
    '~/scale_reason': 'when it changes: OK, WARN (slowed), ERROR (stopped) or STALE (refused), '
    'and the cause with joint or point, margin and time left; a late subscriber gets the last '
    'one',
    '~/servo_status': 'the cause as a code of MoveIt Servo: 0 no warning (also at a velocity or '
    'speed limit), 1 slowed and 2 stopped before a singularity, 3 slowed while leaving one (only '
    "by Servo's rule), 6 position limit, -1 refused",
    '/diagnostics': 'once a second: input rate, age, counts of messages by outcome, missing '
    'joints, publishers; also the statuses `frames`, `parameters` and `wrench` if they apply',
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
            'singularity': 'the task, the named factors, and the thresholds of the warning',
            'speed_limits': 'largest speeds of the tool and of points, for `ks.scale`',
            'uncertainty': 'errors of joints and table',
            'known_poses': 'poses from another source, which `check` compares',
            'tolerance': 'standard deviations of the numbers of the table, for `calibrate`',
        },
    ),
    'UnitsEntry': (
        'units',
        'Without this key the file is in rad and m.',
        {'angle': 'unit of angles', 'length': 'unit of lengths'},
    ),
    'JointEntry': (
        'joints',
        'A revolute joint without `limits` is continuous; a prismatic one is unbounded.',
        {
            'name': 'as the driver publishes it in `joint_states`',
            'variable': 'its name in the table; by default `name`',
            'type': 'a `revolute` variable occurs in `theta`, a `prismatic` one in `d`, a '
            '`helical` one in both',
            'limits': 'range of the joint, `[lower, upper]`',
            'velocity': 'largest speed, per second',
            'acceleration': 'deceleration with which the joint can be stopped, per second squared',
            'unused': '`true` if no row of the table uses the joint, on purpose',
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
        '4 numbers, or is `{xyz, rpy}`; by default it is the identity.',
        {
            'in': 'shape matrix on the side of the link before',
            'joint': 'one of `Rx() ... Tz()` with the joint variable',
            'out': 'shape matrix on the side of the link after',
        },
    ),
    'PlacementEntry': (
        'base and tool',
        'All keys are optional. The default pose is the identity; the default frames are '
        '`base_link` and `tool0`.',
        {'frame': 'name of the frame in ROS', 'xyz': _XYZ, 'rpy': _RPY},
    ),
    'PointEntry': (
        'points',
        'A mapping of names to points. A name may become part of a topic, `~/elbow/pose`. The '
        '`tool` is always a point, and has its own key. In an exported URDF a point is a link.',
        {
            'row': 'the frame that the point moves with, counted as `link_frames` does: 0 is the '
            "table's frame 0, i the frame after row i",
            'xyz': _XYZ + ' in that frame',
            'rpy': _RPY,
        },
    ),
    'LoopEntry': (
        'loops',
        'A list of closed loops. Each is a second chain that leaves the table and meets it '
        "again. Its passive joints have no motor; rows may use them like joints. Newton's method "
        'computes them from the joints, on the branch of the assembled position. A loop may use '
        'the passive joints of earlier loops, and those of later loops that also use its own. '
        'Messages contain only the joints with motors.',
        {
            'name': 'its name in warnings and errors',
            'passive': 'names of the joints that it determines, as many as `rows`; revolute, or '
            'as `{name, type}`',
            'from': "where the second chain begins; by default the table's frame 0",
            'links': 'its rows, in the convention of the table',
            'meets': 'the frame that its end coincides with, moved by the rows of the table',
            'rows': 'components that coincide, of x y z rx ry rz, in the axes of `from`; of a '
            'rotation all three, or fewer if the other axes of the loop are always parallel',
            'assembled': 'a position at which the loop closes, or nearly: it selects the branch, '
            'and is checked',
        },
    ),
    'PassiveEntry': (
        'loops[].passive[]',
        'A joint without a motor. Its limits are those of its loop.',
        {'name': 'in expressions', 'type': 'by default `revolute`'},
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
        'All keys are optional.',
        {
            'task': 'rows of J that count, of `x y z rx ry rz`; by default the rows that the arm '
            'can move',
            'length': 'the characteristic length; by default the RMS reach',
            'measure': 'measure of the warning; by default `distance`, above 16 joints '
            '`condition_number`',
            'warn': 'threshold of WARN; by default that of the measure; for `distance` at most 1 '
            'rad',
            'stop': 'threshold of ERROR; likewise',
            'factors': 'the named singular factors, which `derive --write` stores',
        },
    ),
    'FactorEntry': (
        'singularity.factors',
        'A list.',
        {
            'name': 'its name in the warning',
            'expression': 'a function of the joints whose zeros are singular poses',
            'approximate': '`true` if it belongs to the table without corrections: it names a '
            'nearby singularity and is not used for distances',
        },
    ),
    'SpeedLimitEntry': (
        'speed_limits',
        'A mapping of `tool` and names of points to their largest speeds, per second, for '
        '`ks.scale`.',
        {
            'linear': 'of the origin of the tool or point',
            'angular': 'of its frame',
            'reduced': 'of its origin, with `reduced=True` or `scale.reduced`',
        },
    ),
    'UncertaintyEntry': (
        'uncertainty',
        'Without this key the node publishes no covariances. A key for joints takes a list with '
        'one number for each joint: an angle if it is revolute, a length if it is prismatic. If '
        'all joints are of one kind, it also takes one number for all. Deviations are standard '
        'deviations. A width counts as the standard deviation width / sqrt(12). All errors are '
        'independent.',
        {
            'encoder_noise': 'deviation of joint positions',
            'encoder_resolution': 'step of the encoder: a width',
            'backlash': 'the whole backlash between encoder and joint: a width',
            'velocity_noise': 'deviation of joint velocities, per second',
            'parameters': 'deviations of numbers of the table, by group (`offsets`, `lengths`, '
            '`angles`; `gears`: relative errors of gear ratios) or by the names of `calibrate` '
            '(`theta2`, `a3`, `gear1`, `base.x`, `tool.rz`); a name overrides its group',
            'covariance': 'instead of `parameters`, as `calibrate` writes it: the rows of L, by '
            'name, of their covariance L L^T',
            'floor': '`{xyz, rpy}`: deviation of errors that the keys above do not explain, such '
            'as the remaining error of a fit',
        },
    ),
    'FloorEntry': (
        'uncertainty.floor',
        'All keys are optional.',
        {'xyz': 'along each axis', 'rpy': 'about each axis'},
    ),
    'KnownPoseEntry': (
        'known_poses',
        'A list. Without `rpy` only the position is compared; without `tolerance` to 1e-6 m and '
        'rad. Rounded numbers need a `tolerance`; `check` proposes it.',
        {
            'q': 'joint positions, in the units of the file',
            'xyz': 'position of the tool',
            'rpy': _RPY,
            'tolerance': '`{xyz, rpy}`: how exact the pose is',
        },
    ),
    'ToleranceEntry': (
        'known_poses.tolerance',
        'All keys are optional.',
        {'xyz': 'of the position', 'rpy': 'of the orientation, as an angle'},
    ),
    'TableToleranceEntry': (
        'tolerance',
        'Standard deviations of the priors of a calibration. All keys are optional. The defaults '
        'are 1 mm, 0.2 degrees, and a thousandth of a gear ratio.',
        {
            'length': 'of every length of the table',
            'angle': 'of every angle',
            'gear': 'of every gear ratio, relative to it',
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
    'apps.recordings.plans': 'Kinematics and singularities',
}
