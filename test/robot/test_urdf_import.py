# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Chains of URDFs made into robot files: round trips, other people's URDFs, and what is refused.
"""

import importlib.util
import math
import re
from pathlib import Path

import numpy as np
import pytest
from arms import DISTINCT_BUNDLED, RANDOM, poses, robot_of
from tolerances import ROUND_OFF

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.errors import UrdfError
from kinematics_service.robot.urdf.document import MAX_BYTES

CONVENTIONS = ('standard', 'modified')
# Chains of up to twelve random joints, with lengths to a metre: more products than of one arm.
LONG_CHAIN = 1e-11


def again(robot, convention='standard'):
    """Return a robot that has been a URDF in between."""
    found = ks.import_urdf(
        ks.export_urdf(robot), robot.base_frame, robot.tool_frame, convention=convention
    )
    return found.robot


def same_motion(robot, other, q, tolerance=ROUND_OFF):
    for function in (ks.forward_kinematics, ks.jacobian):
        expected, found = function(robot, q), function(other, q)
        np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize(('name', 'convention'), [*zip(DISTINCT_BUNDLED, 5 * CONVENTIONS)])
def test_a_bundled_robot_comes_back_the_same(name, convention):
    robot = robot_of(name)
    other = again(robot, convention)
    assert other.name == robot.name
    assert other.convention == convention
    assert other.joint_names == robot.joint_names
    assert other.joint_types == robot.joint_types
    assert other.base_frame == robot.base_frame
    assert other.tool_frame == robot.tool_frame
    assert np.array_equal(other.limits, robot.limits)
    assert np.array_equal(other.velocity_limits, robot.velocity_limits)
    same_motion(robot, other, poses(robot, 5))


@pytest.mark.slow
@pytest.mark.parametrize('name', RANDOM[::7])
def test_a_random_arm_comes_back_the_same(name):
    robot = robot_of(name)
    other = again(robot, 'modified' if robot.dof % 2 else 'standard')
    assert other.joint_names == robot.joint_names
    assert np.array_equal(other.limits, robot.limits)
    same_motion(robot, other, poses(robot, 5), LONG_CHAIN)
    sizes = [
        abs(e.affine.constant) for row in other.description.links for e in (row['a'], row['d'])
    ]
    assert max(sizes) < 4.0 * robot.dof


def test_a_vendors_table_is_found_again():
    panda = again(robot_of('panda'), 'modified')
    for ours, theirs in zip(panda.description.links[:6], robot_of('panda').description.links):
        for key in ('a', 'alpha', 'd', 'theta'):
            assert ours[key].affine == theirs[key].affine
    assert panda.description.links[1]['alpha'].text == '-pi/2'


# A URDF of these tests' own: crossing, skew, flipped, sliding, mimicking, and a fixed joint.
ARM = """\
<?xml version="1.0"?>
<robot name="own arm">
  <link name="world"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <link name="e"/><link name="f"/><link name="side"/><link name="lost"/>
  <joint name="mount" type="fixed">
    <origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 0.3"/><parent link="world"/><child link="a"/>
  </joint>
  <joint name="turn" type="revolute">
    <origin xyz="0 0.1 0.4" rpy="1.2 0 0"/><parent link="a"/><child link="b"/>
    <axis xyz="0 -2 0"/><limit lower="-2" upper="1.5" effort="1" velocity="3"/>
  </joint>
  <joint name="slide" type="prismatic">
    <origin xyz="0.3 0 0"/><parent link="b"/><child link="c"/><axis xyz="1 1 0"/>
    <limit lower="-0.1" upper="0.4" effort="1" velocity="0.5"/>
  </joint>
  <joint name="spin" type="continuous">
    <origin xyz="0.2 0 0.1" rpy="0 3.141592653589793 0"/><parent link="c"/><child link="d"/>
  </joint>
  <joint name="follow" type="revolute">
    <origin xyz="0 0.2 0"/><parent link="d"/><child link="e"/><axis xyz="0 0 1"/>
    <mimic joint="turn" multiplier="-0.5" offset="0.25"/>
    <limit lower="-9" upper="9" effort="1" velocity="1"/>
  </joint>
  <joint name="tilt" type="revolute">
    <origin xyz="0.1 0.2 0.3" rpy="0.3 0.2 0.1"/><parent link="e"/><child link="f"/>
    <axis xyz="0.6 0 0.8"/><limit lower="0" upper="3" effort="1" velocity="0"/>
  </joint>
  <joint name="aside" type="floating"><parent link="a"/><child link="side"/></joint>
</robot>
"""


def test_every_kind_of_joint_is_kept():
    found = ks.import_urdf(ARM, 'world', 'f')
    robot = found.robot
    assert robot.name == 'own_arm'
    assert robot.joint_names == ('turn', 'slide', 'spin', 'tilt')
    assert robot.joint_types == ('revolute', 'prismatic', 'revolute', 'revolute')
    assert robot.limits.tolist() == [[-2, 1.5], [-0.1, 0.4], [-math.inf, math.inf], [0, 3]]
    assert robot.velocity_limits.tolist() == [3, 0.5, math.inf, math.inf]
    assert (robot.base_frame, robot.tool_frame) == ('world', 'f')
    assert found.certificate.configurations == 1000
    assert found.certificate.position_error < ROUND_OFF
    assert found.certificate.rotation_error < ROUND_OFF
    assert str(found.certificate) in robot.source
    again = ks.robot_from_text(found.text, robot.description.file)
    assert again.description == robot.description
    assert any('turn' in row['theta'].text and '0.5' in row['theta'].text for row in links(robot))


def links(robot):
    return robot.description.links


def refusal(urdf, *ends, **named):
    """Return the fault for which a URDF is refused; its error has the same code and text."""
    with pytest.raises(UrdfError) as caught:
        ks.import_urdf(urdf, *ends, **named)
    fault = caught.value.fault
    assert (caught.value.code, str(caught.value)) == (fault.code, str(fault))
    return fault


def in_pinocchio(content, base, tip):
    """Return Pinocchio's pose of the tip in the base, of joint positions by name."""
    pinocchio = pytest.importorskip('pinocchio')
    model = pinocchio.buildModelFromXML(content, True)
    data = model.createData()

    def pose(positions):
        whole = pinocchio.neutral(model)
        for name, value in positions.items():
            joint = model.joints[model.getJointId(name)]
            values = [np.cos(value), np.sin(value)] if joint.nq == 2 else value
            whole[joint.idx_q : joint.idx_q + joint.nq] = values
        pinocchio.framesForwardKinematics(model, data, whole)
        T_base, T_tip = (data.oMf[model.getFrameId(link)].homogeneous for link in (base, tip))
        return np.linalg.inv(T_base) @ T_tip

    return pose


def compare_with_pinocchio(content, base, tip, robot, tolerance=ROUND_OFF):
    pose = in_pinocchio(content, base, tip)
    for q in poses(robot, 5):
        expected = pose(dict(zip(robot.joint_names, q)))
        np.testing.assert_allclose(
            ks.forward_kinematics(robot, q), expected, rtol=0, atol=tolerance
        )


@pytest.mark.peers
@pytest.mark.parametrize('convention', CONVENTIONS)
def test_every_kind_of_joint_is_as_pinocchio_has_it(convention):
    robot = ks.import_urdf(ARM, 'world', 'f', convention=convention).robot
    without_floating = re.sub(r'  <joint name="aside".*\n', '', ARM)
    without_floating = re.sub(r'<link name="(side|lost)"/>', '', without_floating)
    compare_with_pinocchio(without_floating, 'world', 'f', robot)


def nearly_parallel(angle):
    """Return three joints with axes that far (rad) from parallel, half a metre apart."""
    joints = ''.join(
        f'<joint name="q{i}" type="continuous"><origin xyz="0.5 0.05 0" rpy="{angle!r} 0 0"/>'
        f'<parent link="l{i}"/><child link="l{i + 1}"/><axis xyz="0 0 1"/></joint>'
        for i in range(3)
    )
    links = ''.join(f'<link name="l{i}"/>' for i in range(5))
    last = (
        '<joint name="end" type="fixed"><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>'
        '<parent link="l3"/><child link="l4"/></joint>'
    )
    return f'<robot name="near">{links}{joints}{last}</robot>'


@pytest.mark.slow
@pytest.mark.parametrize(
    'angle', [10.0**-k * (-1) ** k for k in (1, 4, 5, 6, 9, 12, 16)] + [math.pi - 1e-9]
)
def test_nearly_parallel_axes_make_no_huge_lengths(angle):
    found = ks.import_urdf(nearly_parallel(angle), 'l0', 'l4')
    assert found.certificate.position_error < ROUND_OFF
    assert found.certificate.rotation_error < ROUND_OFF
    lengths = [abs(e.affine.constant) for row in links(found.robot) for e in (row['a'], row['d'])]
    assert max(lengths) < 6.0
    same_motion(found.robot, again(found.robot, 'modified'), poses(found.robot, 3))


def test_axes_that_are_nearly_parallel_are_joined_by_two_rows():
    found = ks.import_urdf(nearly_parallel(1e-5), 'l0', 'l4')
    assert found.certificate.position_error < ROUND_OFF
    assert len(links(found.robot)) > len(
        links(ks.import_urdf(nearly_parallel(0.5), 'l0', 'l4').robot)
    )


def test_rounded_angles_are_read_as_what_they_stand_for():
    text = nearly_parallel(1.5708)
    as_written = ks.import_urdf(text, 'l0', 'l4')
    as_meant = ks.import_urdf(text, 'l0', 'l4', round_angles=True)
    assert [row['alpha'].text for row in links(as_meant.robot)][:2] == ['pi/2', 'pi/2']
    assert '1.5708' in [row['alpha'].text for row in links(as_written.robot)]
    assert as_written.certificate.rotation_error < ROUND_OFF
    # Three times what 1.5708 is off, at most; the certificate does not hide it.
    assert 1e-6 < as_meant.certificate.rotation_error <= 3.001 * (1.5708 - math.pi / 2)


@pytest.mark.parametrize(
    ('text', 'meant'),
    [
        ('1.57', math.pi / 2),
        ('-1.5707', -math.pi / 2),
        ('1.570796325', math.pi / 2),
        ('3.1416', math.pi),
        ('0.7854', math.pi / 4),
        ('1.5', 1.5),
        ('1.57079', math.pi / 2),
        ('1.5711', 1.5711),
        ('1.5707112345', 1.5707112345),
        ('1.57e0', 1.57),
        ('0', 0.0),
        ('0.001', 0.001),
    ],
)
def test_which_angles_are_rounded_parts_of_pi(text, meant):
    from kinematics_service.robot.urdf.quantity import as_rounded_part_of_pi

    assert as_rounded_part_of_pi(text) == pytest.approx(meant, abs=1e-15)


def toolbox_data():
    spec = importlib.util.find_spec('rtbdata')
    return spec and Path(spec.origin).parent / 'xacro'


def example_data():
    spec = importlib.util.find_spec('pinocchio')
    if spec is None:
        return None
    # cmeel packages share one prefix: .../cmeel.prefix/lib/pythonX.Y/site-packages/pinocchio.
    for folder in Path(spec.origin).parents:
        if folder.name == 'cmeel.prefix':
            return folder / 'share' / 'example-robot-data' / 'robots'
    return None


# Package, file, base, tip, and the number of its joints. Nobody here wrote these.
THEIRS = (
    ('rtb-data', 'unimation_puma560_description/urdf/puma560_robot.urdf', 'link1', 'link7', 6),
    ('rtb-data', 'kuka_description/kuka_kr210/urdf/kr210l150.urdf', 'base_link', 'tool0', 6),
    (
        'rtb-data',
        'kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf',
        'base_link',
        'tool0',
        7,
    ),
    ('rtb-data', 'abb_irb140_description/urdf/irb140.urdf', 'base_link', 'tool0', 6),
    (
        'example-robot-data',
        'panda_description/urdf/panda.urdf',
        'panda_link0',
        'panda_hand_tcp',
        7,
    ),
    (
        'example-robot-data',
        'panda_description/urdf/panda.urdf',
        'panda_hand',
        'panda_rightfinger',
        1,
    ),
    ('example-robot-data', 'ur_description/urdf/ur5_robot.urdf', 'base_link', 'tool0', 6),
    (
        'example-robot-data',
        'kinova_description/robots/kinova.urdf',
        'base',
        'j2s6s200_end_effector',
        6,
    ),
    (
        'example-robot-data',
        'so_arm_description/urdf/so101.urdf',
        'base_link',
        'gripper_frame_link',
        5,
    ),
    (
        'example-robot-data',
        'talos_data/robots/talos_left_arm.urdf',
        'arm_left_1_link',
        'wrist_left_ft_tool_link',
        6,
    ),
    (
        'example-robot-data',
        'tiago_description/robots/tiago.urdf',
        'base_footprint',
        'wrist_ft_tool_link',
        8,
    ),
)
FOLDERS = {'rtb-data': toolbox_data, 'example-robot-data': example_data}


@pytest.mark.peers
@pytest.mark.parametrize('theirs', THEIRS, ids=lambda row: f'{Path(row[1]).stem}-{row[3]}')
def test_urdfs_that_nobody_here_wrote(theirs):
    package, path, base, tip, joints = theirs
    folder = FOLDERS[package]()
    if folder is None or not (folder / path).exists():
        pytest.skip(f'needs the package {package}, which brings {path}')
    for convention in CONVENTIONS:
        found = ks.import_urdf(folder / path, base, tip, convention=convention)
        assert found.robot.dof == joints
        assert found.certificate.position_error < ROUND_OFF
        assert found.certificate.rotation_error < ROUND_OFF
        content = (folder / path).read_text(encoding='utf-8')
        compare_with_pinocchio(content, base, tip, found.robot)


JOINT = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/>{}</joint>'
LIMIT = '<limit lower="-1" upper="1" effort="0" velocity="0"/>'


def small(*joints, links='abc', head='<robot name="r">'):
    links = ''.join(f'<link name="{name}"/>' for name in links)
    return (
        f'{head}\n{links}\n' + '\n'.join(JOINT.format(*joint) for joint in joints) + '\n</robot>'
    )


FINE = ('j', 'revolute', 'a', 'b', LIMIT)
LINKS = "links 'a' and 'b'"
REFUSED = {
    'no XML': (
        'robot: <r>',
        (1, '', 'syntax'),
        (),
    ),
    'cut off': (
        small(FINE)[:-3],
        (4, '', 'syntax'),
        (),
    ),
    'empty': (
        '',
        (1, '', 'syntax'),
        (),
    ),
    'another format': (
        '<sdf/>',
        (1, '<sdf>', 'wrong-type'),
        (),
    ),
    'entities': (
        '<?xml version="1.0"?>\n<!DOCTYPE robot [<!ENTITY a "aaaa">]>\n<robot name="&a;"/>',
        (2, '', 'unsupported'),
        (),
    ),
    'a file by entity': (
        '<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>',
        (1, '', 'unsupported'),
        (),
    ),
    'xacro': (
        '<robot xmlns:xacro="http://wiki.ros.org/xacro">\n<xacro:include filename="a"/></robot>',
        (2, '', 'xacro'),
        ('xacro FILE',),
    ),
    'a xacro expression': (
        small(('j', 'revolute', 'a', 'b', '<origin rpy="${pi/2} 0 0"/>' + LIMIT)),
        (3, "<origin> of <joint name='j'>", 'xacro'),
        ("'${pi/2}'", LINKS),
    ),
    'deep': (
        f'{"<robot>" * 70}{"</robot>" * 70}',
        (1, '', 'too-deep'),
        ('64',),
    ),
    'no such base': (
        small(('j', 'revolute', 'c', 'b', LIMIT), links=('base_link', 'c', 'b')),
        (1, "<robot name='r'>", 'unknown-name'),
        ("'a'",),
    ),
    'not below': (
        small(('j', 'revolute', 'c', 'b', LIMIT)),
        (1, "<robot name='r'>", 'wrong-order'),
        ("'b'",),
    ),
    'two parents': (
        small(FINE, ('k', 'revolute', 'c', 'b', LIMIT)),
        (4, "<joint name='k'>", 'loop'),
        ("'b'",),
    ),
    'a circle': (
        small(('j', 'revolute', 'c', 'b', LIMIT), ('k', 'revolute', 'b', 'c', LIMIT)),
        (4, "<joint name='k'>", 'loop'),
        ("'b'",),
    ),
    'floating': (
        small(('j', 'floating', 'a', 'b', '')),
        (3, "<joint name='j'>", 'unsupported'),
        (LINKS,),
    ),
    'planar': (
        small(('j', 'planar', 'a', 'b', '')),
        (3, "<joint name='j'>", 'unsupported'),
        (LINKS,),
    ),
    'unknown type': (
        small(('j', 'hinge', 'a', 'b', '')),
        (3, "<joint name='j'>", 'unknown-name'),
        ("'hinge'", LINKS),
    ),
    'only fixed': (
        small(('j', 'fixed', 'a', 'b', '')),
        (1, "<robot name='r'>", 'no-effect'),
        ("'b'",),
    ),
    'no limit': (
        small(('j', 'revolute', 'a', 'b', '')),
        (3, "<joint name='j'>", 'missing-key'),
        ("'continuous'", LINKS),
    ),
    'limits of one place': (
        small(('j', 'revolute', 'a', 'b', '<limit lower="1.5" upper="1.5"/>')),
        (3, "<limit> of <joint name='j'>", 'wrong-order'),
        ("'fixed'", LINKS),
    ),
    'no axis': (
        small(('j', 'revolute', 'a', 'b', LIMIT + '<axis xyz="0 0 0"/>')),
        (3, "<axis> of <joint name='j'>", 'zero-axis'),
        ("'0 0 0'", LINKS),
    ),
    'two numbers': (
        small(('j', 'revolute', 'a', 'b', LIMIT + '<origin xyz="0 0"/>')),
        (3, "<origin> of <joint name='j'>", 'wrong-length'),
        ("'0 0'", LINKS),
    ),
    'commas between numbers': (
        small(('j', 'revolute', 'a', 'b', LIMIT + '<origin rpy="0 1.57, 0"/>')),
        (3, "<origin> of <joint name='j'>", 'decimal-comma'),
        ("'0 1.57, 0'", LINKS),
    ),
    'a decimal comma': (
        small(('j', 'revolute', 'a', 'b', LIMIT + '<origin xyz="0 0,5 0"/>')),
        (3, "<origin> of <joint name='j'>", 'not-a-number'),
        ("'0,5'", LINKS),
    ),
    'not a number': (
        small(('j', 'revolute', 'a', 'b', LIMIT + '<origin xyz="0 nan 0"/>')),
        (3, "<origin> of <joint name='j'>", 'not-a-number'),
        ("'nan'", LINKS),
    ),
    'no child': (
        '<robot name="r"><link name="a"/>\n'
        '<joint name="j" type="fixed"><parent link="a"/></joint></robot>',
        (2, "<joint name='j'>", 'missing-key'),
        (),
    ),
    'a child that is not there': (
        small(('j', 'revolute', 'a', 'z', LIMIT)),
        (3, "<joint name='j'>", 'unknown-name'),
        ("'z'",),
    ),
    'one name twice': (
        small(FINE, ('j', 'fixed', 'b', 'c', '')),
        (4, "<joint name='j'>", 'duplicate-name'),
        ('3',),
    ),
    'mimics nobody': (
        small(('j', 'continuous', 'a', 'b', '<mimic joint="x"/>')),
        (3, "<joint name='j'>", 'unknown-name'),
        ("'x'", LINKS),
    ),
    'mimics a misspelt one': (
        small(
            ('elbow', 'continuous', 'b', 'c', ''),
            ('j', 'continuous', 'a', 'b', '<mimic joint="elbwo"/>'),
        ),
        (4, "<joint name='j'>", 'unknown-name'),
        ("'elbwo'", LINKS),
    ),
    'mimics itself': (
        small(('j', 'continuous', 'a', 'b', '<mimic joint="j"/>')),
        (3, "<joint name='j'>", 'circular'),
        (LINKS,),
    ),
    'mimics a fixed one': (
        small(('k', 'fixed', 'b', 'c', ''), ('j', 'continuous', 'a', 'b', '<mimic joint="k"/>')),
        (4, "<joint name='j'>", 'wrong-joint-type'),
        ("'k'", LINKS),
    ),
    'a rack': (
        small(
            ('k', 'continuous', 'b', 'c', ''),
            ('j', 'prismatic', 'a', 'b', LIMIT + '<mimic joint="k"/>'),
        ),
        (4, "<joint name='j'>", 'wrong-joint-type'),
        ("'k'", LINKS),
    ),
    'a name with a comma': (
        small(('j,k', 'revolute', 'a', 'b', LIMIT)),
        (3, "<joint name='j,k'>", 'wrong-name'),
        ('256',),
    ),
}


@pytest.mark.parametrize('fault', REFUSED)
def test_what_is_refused_is_said_with_its_line(fault):
    text, place, words = REFUSED[fault]
    found = refusal(text, 'a', 'b')
    assert (found.line, found.where, found.code) == place
    assert all(word in found.message for word in words)


def test_a_refusal_of_a_urdf_for_a_person():
    text, _, _ = REFUSED['commas between numbers']
    assert str(refusal(text, 'a', 'b')) == (
        "<text>:3: <origin> of <joint name='j'>: rpy: '0 1.57, 0' has commas between its numbers; "
        "write '0 1.57 0'; the joint is between links 'a' and 'b'"
    )


def test_a_path_and_the_text_of_its_file_are_the_same_arm(urdf):
    of_text = ks.import_urdf(urdf.read_text(), 'world', 'f')
    for path in (urdf, str(urdf)):
        found = ks.import_urdf(path, 'world', 'f')
        assert found.text == of_text.text.replace('URDF, robot', 'URDF own.urdf, robot')
        assert found.text != of_text.text
    fault = refusal('no_such.urdf', 'world', 'f')
    assert (fault.file, fault.code) == ('no_such.urdf', 'missing-file')
    assert refusal(5).code == 'wrong-type'


def test_a_file_that_never_ends_is_refused():
    for urdf in (f'<robot>{" " * MAX_BYTES}</robot>', '/dev/zero'):
        fault = refusal(urdf, 'a', 'b')
        assert fault.code == 'too-large'
        assert '8 MiB' in fault.message


def test_what_a_broken_part_elsewhere_says_does_not_matter():
    text = small(FINE, ('k', 'floating', 'b', 'c', '<origin xyz="?"/>'))
    assert ks.import_urdf(text, 'a', 'b').robot.joint_names == ('j',)


def test_names_of_yaml_and_of_expressions_are_only_names():
    text = small(('true', 'revolute', 'no: {', 'pi', LIMIT), links=('no:{', 'pi')).replace(
        'no: {', 'no:{'
    )
    robot = ks.import_urdf(text, 'no:{', 'pi').robot
    assert (robot.joint_names, robot.base_frame, robot.tool_frame) == (('true',), 'no:{', 'pi')


@pytest.fixture
def urdf(tmp_path):
    path = tmp_path / 'own.urdf'
    path.write_text(ARM)
    return path


def test_the_command_writes_a_file_that_checks(capsys, tmp_path, urdf):
    out = tmp_path / 'own.yaml'
    arguments = ['import', '--urdf', str(urdf), '--base', 'world', '--tip', 'f', '--out', str(out)]
    assert main([*arguments, '--name', 'mine', '--convention', 'modified']) == 0
    said = capsys.readouterr().out
    assert re.fullmatch(
        r'mine: worst pose error over 1000 random configurations inside the limits: '
        rf'\d\.\de-\d+ m, \d\.\de-\d+ rad\nwrote {re.escape(str(out))}\n',
        said,
    )
    assert said.partition(': ')[2].splitlines()[0] in ks.load_robot(out).source
    assert main(['check', str(out)]) == 0
    checked = capsys.readouterr().out
    assert '2 of 2 agree' in checked
    assert 'modified' in checked


def test_the_command_prints_the_robot_file_alone(capsys, urdf):
    assert main(['import', '--urdf', str(urdf), '--base', 'world', '--tip', 'f']) == 0
    out, err = capsys.readouterr()
    assert ks.robot_from_text(out).name == 'own_arm'
    assert err.startswith('own_arm: worst pose error')


@pytest.mark.parametrize(
    ('arguments', 'code', 'sentence'),
    [
        (['--base', 'world', '--tip', 'g'], 1, "'g' for the tip (links: world, a, b"),
        (['--base', 'world', '--tip', 'f', '--name', 'a b'], 2, "--name: 'a b'"),
        (['--base', 'world', '--tip', 'side'], 1, 'a floating joint'),
        (['--base', 'world', '--tip', 'f', '--out', '/no/folder/x.yaml'], 1, 'cannot be written'),
    ],
)
def test_the_command_refuses_in_a_sentence(capsys, urdf, arguments, code, sentence):
    assert main(['import', '--urdf', str(urdf), *arguments]) == code
    err = capsys.readouterr().err
    assert sentence in err
    assert 'Traceback' not in err


def test_a_file_that_is_not_there_is_named(capsys, tmp_path):
    missing = tmp_path / 'missing.urdf'
    assert main(['import', '--urdf', str(missing), '--base', 'a', '--tip', 'b']) == 1
    assert f'{missing}: no such file' in capsys.readouterr().err


# The longest chain, and what is possible beside it.

HAND = (
    ('turn', 'revolute', 'base', 'upper', LIMIT + '<axis xyz="0 0 1"/>'),
    ('bend', 'revolute', 'upper', 'wrist', LIMIT + '<axis xyz="0 0 1"/><origin xyz="0.4 0 0"/>'),
    ('flange', 'fixed', 'wrist', 'tool', '<origin xyz="0.1 0 0"/>'),
    ('eye', 'fixed', 'upper', 'camera', ''),
)
FINGERS = (
    ('left', 'prismatic', 'wrist', 'left_finger', LIMIT),
    ('right', 'prismatic', 'wrist', 'right_finger', LIMIT + '<mimic joint="left"/>'),
)


def tree_of(*joints):
    links = dict.fromkeys(link for joint in joints for link in joint[2:4])
    return small(*joints, links=tuple(links))


@pytest.mark.parametrize(
    ('joints', 'base', 'tip', 'others'),
    [
        (HAND[:3], 'base', 'tool', ''),
        (HAND, 'base', 'tool', 'camera (1)'),
        # Neither fingers nor one jaw end an arm.
        ((*HAND, *FINGERS), 'base', 'tool', 'left_finger (3), right_finger (3), camera (1)'),
        ((*HAND[:2], *FINGERS), 'base', 'wrist', 'left_finger (3), right_finger (3)'),
        ((*HAND, FINGERS[0]), 'base', 'tool', 'left_finger (3), camera (1)'),
        # Two arms of one trunk: the first.
        (
            (
                ('trunk', 'revolute', 'base', 'chest', LIMIT),
                *(
                    (f'{side}{k}', 'revolute', near, f'{side}{k}', LIMIT)
                    for side in 'lr'
                    for k, near in enumerate(('chest', f'{side}0', f'{side}1'))
                ),
            ),
            'base',
            'l2',
            'r2 (4)',
        ),
        # Each with two fingers: the hand of the first.
        (
            tuple(
                (f'{side}{k}', 'revolute', near, f'{side}{k}', LIMIT)
                for side in 'lr'
                for k, near in enumerate(('base', *(f'{side}{n}' for n in (0, 1, 1))))
            ),
            'base',
            'l1',
            'l2 (3), l3 (3), r2 (3), r3 (3)',
        ),
        # A mobile base: what moves freely is no joint of an arm.
        (
            (('drive', 'planar', 'odom', 'cart', ''), ('m', 'fixed', 'cart', 'base', ''), *HAND),
            'cart',
            'tool',
            'camera (1)',
        ),
    ],
)
def test_the_longest_chain_is_taken_and_others_are_told(joints, base, tip, others):
    found = ks.import_urdf(tree_of(*joints))
    assert (found.robot.base_frame, found.robot.tool_frame) == (base, tip)
    choice = ''.join(map(str, found.doubts))
    if others:
        assert f'joints: {others};' in choice
        assert [doubt.code for doubt in found.doubts] == ['chosen-chain']
        assert choice.endswith(f'write <text>:{base}:{others.split()[0]}')
    else:
        assert not choice


def test_where_the_chosen_chain_is_refused_others_are_told():
    text = tree_of(*HAND).replace('xyz="0.1 0 0"', 'xyz="0.1, 0, 0"')
    fault = refusal(text)
    assert (fault.where, fault.code) == ("<origin> of <joint name='flange'>", 'decimal-comma')
    assert 'camera (1)' in fault.message
    assert fault.message.endswith('<text>:base:camera')
    assert ks.import_urdf(text, 'base', 'camera').robot.joint_names == ('turn',)


def test_blank_lines_before_the_declaration_are_accepted():
    text = '\n \t\r\n<?xml version="1.0"?>\n' + small(FINE)
    assert ks.import_urdf(text).robot.joint_names == ('j',)
    fault = refusal(text.replace(LIMIT, ''), 'a', 'b')
    assert (fault.line, fault.where, fault.code) == (6, "<joint name='j'>", 'missing-key')


def test_one_end_of_the_chain_may_be_named():
    text = tree_of(*HAND)
    assert ks.import_urdf(text, tip='camera').robot.joint_names == ('turn',)
    assert ks.import_urdf(text, base='upper').robot.joint_names == ('bend',)
    for base, code in (('wrist', 'no-effect'), ('nobody', 'unknown-name')):
        fault = refusal(text, base=base)
        assert fault.code == code
        assert repr(base) in fault.message


def test_no_chain_can_be_chosen_where_nothing_moves():
    for kind in ('fixed', 'floating'):
        fault = refusal(small(('j', kind, 'a', 'b', '')))
        assert (fault.line, fault.code) == (1, 'no-effect')


def test_limits_that_are_none_are_none_and_told():
    text = small(
        ('j', 'revolute', 'a', 'b', '<limit effort="9" velocity="1"/>'),
        ('k', 'prismatic', 'b', 'c', '<limit lower="-999999" upper="999999"/>'),
    )
    found = ks.import_urdf(text)
    assert np.isinf(found.robot.limits).all()
    assert [(doubt.line, doubt.where, doubt.code) for doubt in found.doubts] == [
        (3, "<limit> of <joint name='j'>", 'no-limits'),
        (4, "<limit> of <joint name='k'>", 'no-limits'),
    ]
    assert '-999999' in found.doubts[1].message


@pytest.mark.parametrize('farthest', [99.0, 9999.0])
def test_a_long_way_is_not_taken_for_a_table_that_is_not_exact(farthest):
    limit = f'<limit lower="-{farthest}" upper="{farthest}"/>'
    skew = '<axis xyz="1 2 3"/><origin xyz="0.1 0.2 0.3" rpy="0.4 1.5708 0.6"/>'
    text = small(
        ('x', 'prismatic', 'a', 'b', limit + skew),
        ('y', 'prismatic', 'b', 'c', limit + skew),
        ('j', 'continuous', 'c', 'd', skew),
        links='abcd',
    )
    found = ks.import_urdf(text)
    assert found.robot.limits[:2].tolist() == [[-farthest, farthest]] * 2
    # Other than the unit.
    assert [doubt.where for doubt in found.doubts] == ["<joint name='x'>"]
    assert f'a stroke to {farthest:g} m' in found.doubts[0].message


def test_links_with_a_leading_slash_lose_it():
    joints = (
        ('j', 'revolute', '/a', '/b', LIMIT + '<origin xyz="1 0 0"/>'),
        ('t', 'fixed', 'b', '/tool', '<origin xyz="0 1 0"/>'),
    )
    text = small(*joints, links=('/a', '/b', '/tool'))
    for found in (ks.import_urdf(text), ks.import_urdf(text, '/a', 'tool')):
        assert (found.robot.base_frame, found.robot.tool_frame) == ('a', 'tool')
        np.testing.assert_allclose(
            ks.forward_kinematics(found.robot, [0.0])[:3, 3], [1, 1, 0], rtol=0, atol=ROUND_OFF
        )


def test_a_name_that_no_robot_file_holds_is_refused_with_its_line():
    text = small(('j', 'revolute', 'my base', 'b', LIMIT), links=('my base', 'b'))
    fault = refusal(text)
    assert (fault.line, fault.where, fault.code) == (2, "<link name='my base'>", 'wrong-name')


# A URDF in the place of a robot.


@pytest.fixture
def hand(tmp_path):
    path = tmp_path / 'hand.urdf'
    path.write_text(tree_of(*HAND))
    return path


def test_a_urdf_is_a_robot_of_the_library(hand):
    expected = ks.import_urdf(hand, 'base', 'tool').robot
    q = [0.3, -0.4]
    for name in (hand, str(hand), f'{hand}:base:tool', f'{hand}::tool', f'{hand}:base:'):
        for robot in (name, ks.load_robot(name)):
            same = ks.forward_kinematics(robot, q) == ks.forward_kinematics(expected, q)
            assert same.all()
    assert ks.load_robot(f'{hand}::camera').joint_names == ('turn',)
    loaded = ks.load_robot(hand)
    assert (loaded.description.file, len(loaded.description.sha256)) == (str(hand), 64)
    # Read again when it has changed, each chain for itself.
    hand.write_text(tree_of(*HAND).replace('0.4 0 0', '0.7 0 0'))
    assert math.isclose(ks.forward_kinematics(str(hand), [0, 0])[0, 3], 0.8)
    assert ks.forward_kinematics(f'{hand}::camera', [0])[0, 3] == 0.0


@pytest.mark.parametrize(
    'command',
    [
        ['fk', '--robot', 'FILE', '--q', '0.1,0.2'],
        ['ik', '--robot', 'FILE', '--xyz', '0.48,0.05,0'],
        ['check', 'FILE'],
        ['check', '--robot', 'FILE'],
        ['export', 'FILE', '--urdf', '-'],
    ],
)
def test_every_command_takes_a_urdf(capsys, hand, command):
    words = [word.replace('FILE', str(hand)) for word in command]
    assert main(words) == 0
    out, err = capsys.readouterr()
    assert 'tool' in out or '0.5' in out
    assert 'WARN' in err
    assert 'camera (1)' in err
    assert f'write {hand}' in err
    # The ends by options, wherever they stand; and nothing is left to doubt.
    assert main([*words, '--base', 'base', '--tip=tool']) == 0
    assert capsys.readouterr() == (out, '')


@pytest.mark.parametrize(
    ('words', 'code', 'sentence'),
    [
        (['fk', '--robot', 'ur5e', '--tip', 'tool0'], 2, 'give one URDF'),
        (['check', 'a.urdf', 'b.urdf', '--tip', 'tool0'], 2, 'give one URDF'),
        (['fk', '--robot', 'a.urdf', '--tip'], 2, '--tip:'),
        (['fk', '--robot', 'no.urdf', '--tip', 'a', '--q', '0'], 2, 'no.urdf: no such file;'),
        (['check', 'no.urdf'], 1, 'no.urdf: no such file;'),
        (['fk', '--robot', 'topic:/robot_description', '--q', '0'], 2, 'only the node'),
        (['derive', 'HAND', '--write'], 2, '--write: a URDF'),
    ],
)
def test_what_is_no_chain_of_a_urdf_is_said(capsys, hand, words, code, sentence):
    assert main([word.replace('HAND', str(hand)) for word in words]) == code
    assert sentence in capsys.readouterr().err


def test_xacro_in_the_place_of_a_robot_is_told_how_to_expand_it(capsys, tmp_path):
    path = tmp_path / 'arm.urdf.xacro'
    path.write_text(REFUSED['xacro'][0])
    assert main(['fk', '--robot', str(path), '--q', '0']) == 1
    err = capsys.readouterr().err
    assert f'{path}:2: <xacro:include>' in err
    assert 'xacro FILE' in err


def test_the_command_chooses_the_chain_that_is_not_named(capsys, hand):
    assert main(['import', '--urdf', str(hand)]) == 0
    out, err = capsys.readouterr()
    assert ks.robot_from_text(out).tool_frame == 'tool'
    assert f'write {hand}:base:camera' in err


TWO_ARMS = """<robot name="torso">
  <link name="base"/><link name="chest"/><link name="left_arm"/><link name="left_tool"/>
  <link name="right_arm"/><link name="right_hand"/><link name="right_tool"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="chest"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="left" type="revolute"><parent link="chest"/><child link="left_arm"/>
    <origin xyz="0.1 0.3 0.2" rpy="0.3 -0.4 0.5"/><axis xyz="0 1 1"/>
    <limit lower="-1" upper="2" effort="1" velocity="3"/></joint>
  <joint name="left_slide" type="prismatic"><parent link="left_arm"/><child link="left_tool"/>
    <origin xyz="0.4 0 0.1" rpy="0 0.7 0"/><axis xyz="1 0 0"/><mimic joint="left" multiplier="0.2"
    offset="0.05"/><limit lower="-1" upper="2" effort="1" velocity="3"/></joint>
  <joint name="right" type="continuous"><parent link="chest"/><child link="right_arm"/>
    <origin xyz="0.1 -0.3 0.2" rpy="-0.3 0.4 0.1"/><axis xyz="0 0 -1"/></joint>
  <joint name="right_wrist" type="revolute"><parent link="right_arm"/><child link="right_hand"/>
    <origin xyz="0.5 0 0" rpy="1.57079632679 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="2"/></joint>
  <joint name="right_fixed" type="fixed"><parent link="right_hand"/><child link="right_tool"/>
    <origin xyz="0 0.1 0.2" rpy="0 0 1"/></joint>
</robot>"""
WAYS = [
    ('left_tool', 'right_tool', ('left', 'right', 'right_wrist')),
    ('right_tool', 'left_tool', ('right_wrist', 'right', 'left')),
    ('right_tool', 'left_arm', ('right_wrist', 'right', 'left')),
    ('left_arm', 'right_hand', ('left', 'right', 'right_wrist')),
]


@pytest.mark.parametrize('convention', CONVENTIONS)
@pytest.mark.parametrize(('base', 'tip', 'joints'), WAYS)
def test_a_chain_goes_up_and_down_again(base, tip, joints, convention):
    pinocchio = pytest.importorskip('pinocchio')
    robot = ks.import_urdf(TWO_ARMS, base, tip, convention=convention).robot
    assert robot.joint_names == joints
    assert (robot.base_frame, robot.tool_frame) == (base, tip)
    model = pinocchio.buildModelFromXML(TWO_ARMS, mimic=True)
    data = model.createData()
    random = np.random.default_rng(2)
    for _ in range(5):
        values = dict(zip(joints, random.uniform(-1, 1, 3)), lift=random.uniform(0, 1))
        q = pinocchio.neutral(model)
        for name, value in values.items():
            joint = model.joints[model.getJointId(name)]
            angles = (np.cos(value), np.sin(value)) if joint.nq == 2 else (value,)
            q[joint.idx_q : joint.idx_q + joint.nq] = angles
        pinocchio.framesForwardKinematics(model, data, q)
        A, B = (data.oMf[model.getFrameId(link)].homogeneous for link in (base, tip))
        found = ks.forward_kinematics(robot, [values[name] for name in joints])
        np.testing.assert_allclose(found, np.linalg.inv(A) @ B, rtol=0, atol=LONG_CHAIN)


def test_upwards_alone_there_is_no_chain():
    fault = refusal(TWO_ARMS, 'left_tool', 'base')
    assert fault.code == 'wrong-order'
    assert "'base' is not below 'left_tool'" in fault.message
    apart = TWO_ARMS.replace(
        '<joint name="left" type="revolute"><parent link="chest"/>',
        '<joint name="left" type="revolute"><parent link="floor"/>',
    ).replace('<link name="base"/>', '<link name="base"/><link name="floor"/>')
    assert refusal(apart, 'left_tool', 'right_tool').code == 'wrong-order'


CELL = """
cell: two
common: [lift]
arms:
  left: {robot: 'two.urdf:base:left_tool'}
  right: {robot: 'two.urdf:base:right_tool'}
"""


def test_a_cell_of_the_chains_of_a_urdf_says_the_same(tmp_path):
    (tmp_path / 'two.urdf').write_text(TWO_ARMS)
    (tmp_path / 'cell.yaml').write_text(CELL)
    cell = ks.load_robot(tmp_path / 'cell.yaml')
    way = ks.load_robot(f'{tmp_path}/two.urdf:left_tool:right_tool')
    assert cell.joint_names == way.joint_names == WAYS[0][2]
    q = poses(way)
    np.testing.assert_allclose(
        ks.forward_kinematics(cell, q), ks.forward_kinematics(way, q), rtol=0, atol=LONG_CHAIN
    )
    left = ks.load_robot(f'{tmp_path}/cell.yaml:cell:left')
    assert left.joint_names == ('lift', 'left')


def test_joints_that_mimic_are_kept_with_their_formulas(tmp_path):
    moving = ''.join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k - 1}"/><child link="l{k}"/>'
        f'<origin xyz="0.1 0 0" rpy="0.5 0 0"/><axis xyz="0 0 1"/>{mimic}'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k, mimic in (
            (1, ''),
            (2, '<mimic joint="j1" multiplier="2" offset="0.1"/>'),
            (3, '<mimic joint="j2" multiplier="-1"/>'),
        )
    )
    links = ''.join(f'<link name="l{k}"/>' for k in range(4))
    file = tmp_path / 'arm.urdf'
    file.write_text(f'<robot name="arm">{links}{moving}</robot>')
    robot = ks.load_robot(file)
    assert robot.joint_names == ('j1',)
    assert robot.description.mimics == (
        ('j2', 'j1', 2.0, 0.1, False),
        ('j3', 'j1', -2.0, -0.1, False),
    )
