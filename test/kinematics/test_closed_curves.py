"""Curves of arms with a closed form where one joint is held: beside those of slices."""

import itertools
import math

import numpy as np
import pytest
from redundant_arms import (
    WHOLE,
    closed_form_arm,
    farthest_from_curve,
    poses_within,
    redundant_arm,
)

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics.inverse.problem.target import ik_target_of
from kinematics_service.kinematics.inverse.self_motion import sliced_arm
from kinematics_service.kinematics.inverse.self_motion.curve_search import CurveSearch
from kinematics_service.kinematics.inverse.self_motion.sliced_arm import sliced_arm_of

CLOSED = ('panda', 'fr3', 'kuka_iiwa14', 'xarm7')
OTHERS = ('kinova_gen3', 'panda-calibrated', 'RRRRRRR-0', 'RRPRRRR-0')
SLICES = np.linspace(-3.0, 3.0, 25)
ON_CURVE = 1e-9
BESIDE_SINGULAR = 1e-7  # where round-off of the target moves solutions by its root
REAL = 1e-9  # imaginary parts of a slice's solutions that are real


def search_of(robot, pose, closed=True):
    arm = sliced_arm_of(robot, WHOLE, '')
    return CurveSearch(arm if closed else arm._replace(closed=None), ik_target_of(robot, pose))


def lost(search, positions=SLICES):
    """Return how many real solutions of slices are on no curve, and how many there are."""
    missed, count = 0, 0
    for slices in search.arm.slices:
        for position in positions:
            found = search.arm.solutions(slices, search.target, float(position))
            for one in found[np.max(np.abs(found[:, :, 1]), axis=1) < REAL, :, 0]:
                away = [farthest_from_curve(curve, one) for curve in search.curves]
                missed += min(away, default=math.inf) > ON_CURVE
                count += 1
    return missed, count


def assert_curves_are_true(search, robot, pose):
    for curve in search.curves:
        for psi in curve.psi[:: max(len(curve.psi) // 7, 1)]:
            q = search.arm.to_joints(psi, robot.dof)
            assert np.max(np.abs(ks.forward_kinematics(robot, q) - pose)) < 1e-12
        steps = np.diff(curve.psi, axis=0)
        assert np.max(np.abs(steps)) <= 0.1 + 1e-12
        assert np.all(np.sum(steps * curve.tangents[:-1], axis=1) > 0.0)
        assert np.all(np.sum(steps * curve.tangents[1:], axis=1) > 0.0)
        turns = (curve.psi[-1] - curve.psi[0]) / math.tau
        assert np.max(np.abs(turns - np.round(turns))) < 1e-14


@pytest.mark.parametrize('name', CLOSED)
def test_bundled_arms_have_a_closed_form_with_one_joint_held(name):
    assert sliced_arm_of(redundant_arm(name), WHOLE, '').closed is not None


@pytest.mark.parametrize('name', OTHERS)
def test_other_arms_have_none(name):
    assert sliced_arm_of(redundant_arm(name), WHOLE, '').closed is None


@pytest.mark.slow
@pytest.mark.parametrize('name', [*CLOSED, *range(4)])
def test_closed_curves_are_those_of_the_slices(name):
    robot = redundant_arm(name) if isinstance(name, str) else closed_form_arm(name)
    proved, counted, taken = 0, 0, 0
    for q in poses_within(robot, 2):
        pose = ks.forward_kinematics(robot, q)
        closed, sliced = search_of(robot, pose), search_of(robot, pose, closed=False)
        is_taken = closed._take_closed()
        taken += is_taken
        assert is_taken or closed.prove()
        assert_curves_are_true(closed, robot, pose)
        psi = closed.arm.to_screws(q)
        assert min(farthest_from_curve(curve, psi) for curve in closed.curves) < ON_CURVE
        missed, count = lost(closed)
        counted += count
        assert not missed
        if sliced.prove():
            proved += 1
            assert len(sliced.curves) == len(closed.curves)
            for curve in sliced.curves:
                away = [farthest_from_curve(one, curve.psi[0]) for one in closed.curves]
                assert min(away) < ON_CURVE
        if proved and taken:
            break
    assert proved
    assert counted
    # A number that is not certain leaves a target to the slices: that is for few of them.
    assert taken


@pytest.mark.parametrize(('name', 'zeros'), [('panda', (1,)), ('kuka_iiwa14', (1,))])
def test_a_target_with_a_singular_pose_is_left_to_the_slices(name, zeros):
    robot = redundant_arm(name)
    q = poses_within(robot, 1)[0]
    q[list(zeros)] = 0.0
    search = search_of(robot, ks.forward_kinematics(robot, q))
    assert not search._take_closed()
    assert not search.curves


@pytest.mark.parametrize(
    ('name', 'q'),
    [
        # Where joints 3 and 4 are both at an end of their range but for 1e-8 to 1e-4 rad, a root
        # is put to the wrong sign of Y: pieces on both sides of it, or none.
        ('panda', (-1.25778, 0.77627, -2.17223, -0.46700244284569, -1.57080, 1.28679, 1.48506)),
        ('panda', (-2.2192, -0.3749, -0.8577, -3.60859506957439, -1.57074313571, -1.3e-8, 1.3429)),
    ],
)
def test_where_pieces_are_not_apart_nothing_is_traced(name, q):
    robot = redundant_arm(name)
    arm, target = sliced_arm_of(robot, WHOLE, ''), ks.forward_kinematics(robot, q)
    checked = ik_target_of(robot, target)
    samples, lengths = np.full((3000, 14), np.nan), np.zeros(16, dtype=np.int64)
    motion = np.ascontiguousarray(arm.motion(checked))
    assert kernel.closed_curves(arm.closed, arm.point(checked), motion, samples, lengths) == -1
    assert np.isnan(samples).all()


@pytest.mark.parametrize('name', CLOSED)
def test_nearer_to_a_singular_target_no_curve_is_missing_until_it_is_not_decided(name):
    robot = redundant_arm(name)
    for pose, joint in itertools.product(poses_within(robot, 1), (1, 3, 5)):
        q, decided = pose.copy(), []
        for share in 10.0 ** -np.arange(1.0, 15.0, 1.5):
            q[joint] = share
            search = search_of(robot, ks.forward_kinematics(robot, q))
            decided.append(search._take_closed())
            if decided[-1]:
                psi = search.arm.to_screws(q)
                away = min(farthest_from_curve(curve, psi) for curve in search.curves)
                assert away < BESIDE_SINGULAR
                assert lost(search, SLICES[::12])[0] == 0
        assert any(decided)
        assert joint != 1 or not decided[-1]


@pytest.mark.parametrize('name', ['panda', 'kuka_iiwa14', 'xarm7'])
def test_a_stretched_elbow_is_not_decided(name):
    # Where two solutions of joint 4 are one along the whole curve, or about to vanish.
    robot = redundant_arm(name)
    q = poses_within(robot, 1)[0]
    arm = sliced_arm_of(robot, WHOLE, '')
    reach = []
    for angle in np.linspace(-math.pi, math.pi, 2001):
        q[3] = angle
        T = ks.forward_kinematics(robot, q)
        reach.append(np.linalg.norm(T[:3, 3] - arm.screws.points[0]))
    q[3] = np.linspace(-math.pi, math.pi, 2001)[int(np.argmax(reach))]
    pose = ks.forward_kinematics(robot, q)
    low, high = 1.0, 1.5
    for _ in range(40):
        middle = 0.5 * (low + high)
        moved = pose.copy()
        moved[:3, 3] *= middle
        search = search_of(robot, moved)
        decided = search._take_closed()
        if not decided:
            return
        if search.curves:
            assert lost(search, SLICES[::4])[0] == 0
            low = middle
        else:
            high = middle
    pytest.fail('the border between some and none was never undecided')


@pytest.mark.parametrize('share', [1e-2, 1e-3, 1e-4])
def test_closed_curves_that_nearly_meet_stay_apart(share):
    robot = redundant_arm('panda')
    q = poses_within(robot, 1)[0]
    q[1] = share
    pose = ks.forward_kinematics(robot, q)
    search = search_of(robot, pose)
    assert search.prove()
    assert_curves_are_true(search, robot, pose)
    psi = search.arm.to_screws(q)
    assert min(farthest_from_curve(curve, psi) for curve in search.curves) < ON_CURVE
    assert lost(search, SLICES[::2])[0] == 0


# Motions from rest to targets at which one condition alone says that nothing is certain: arm, its
# error, the motion (its first three rows). A root is alone: the first two. D is above its noise.
NOT_CERTAIN = (
    (
        3,
        3.3945732939777344e-11,
        [
            0.1761448512702822,
            0.6757437927810089,
            -0.7157816132654619,
            -1.3858902051048045,
            -0.9558673360146055,
            0.2911168119992728,
            0.039606031254363905,
            0.25225310752219227,
            0.23513959111836452,
            0.6772158653555878,
            0.6972001465858789,
            -0.4724359790000714,
        ],
    ),
    (
        'kuka_iiwa14',
        3.7492994521672254e-10,
        [
            -0.45475749033731316,
            0.24997713361981744,
            -0.8548140485797648,
            0.9790554261532736,
            -0.4926989320088476,
            0.7289412821668411,
            0.475281358302956,
            -0.9340400267000457,
            0.7419187201974684,
            0.6373037265073709,
            -0.2083280413203388,
            1.1666749809309038,
        ],
    ),
    (
        3,
        4.295979271245906e-09,
        [
            -0.18186702700037233,
            -0.5722485661110254,
            -0.7996599046306633,
            0.6303830161973565,
            -0.0708473916397432,
            -0.8034828836564198,
            0.5910972024709719,
            -0.04559154619917634,
            -0.9807675726633152,
            0.16415490932360127,
            0.10558472501772984,
            0.006575820514672261,
        ],
    ),
    (
        4,
        6.623311284309626e-10,
        [
            0.43564689864782263,
            -0.8412536082230502,
            -0.32016268731729597,
            0.793493061848682,
            -0.6902385243927199,
            -0.5405200570517356,
            0.48104973481850005,
            -0.16910661890959658,
            -0.5777391791653864,
            0.01142079579046093,
            -0.8161415356914621,
            -1.7861867810883707,
        ],
    ),
)


@pytest.mark.parametrize(('name', 'error', 'rows'), NOT_CERTAIN)
def test_what_the_error_of_an_arm_leaves_open_is_not_decided(name, error, rows, monkeypatch):
    robot = redundant_arm(name) if isinstance(name, str) else closed_form_arm(name)
    motion = np.vstack([np.reshape(rows, (3, 4)), [0.0, 0.0, 0.0, 1.0]])
    arm, form = sliced_arm_of(robot, WHOLE, ''), kernel.ClosedCurves

    def curves_of(closed):
        point = kernel.CurvePoint(arm.table, motion, motion[:3, 3].copy(), True, arm.length)
        samples, lengths = np.empty((9000, 14)), np.zeros(64, dtype=np.int64)
        return kernel.closed_curves(closed, point, motion, samples, lengths)

    assert curves_of(arm.closed) > 0
    monkeypatch.setattr(sliced_arm.kernel, 'ClosedCurves', lambda *of: form(*of[:-1], error))
    assert curves_of(sliced_arm._closed_curves(arm.screws)) == -1


def test_axes_that_nearly_meet_are_no_closed_form():
    assert sliced_arm_of(closed_form_arm(0), WHOLE, '').closed is not None
    for off in (1e-10, 1e-6):
        assert sliced_arm_of(closed_form_arm(0, off), WHOLE, '').closed is None
