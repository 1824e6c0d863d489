# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
What a URDF says is read by its version, or named: against a second, plain reader of the XML.
"""

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.errors import UrdfError
from kinematics_service.robot.urdf.document import parse_urdf

# Products of up to eight joints, each of a metre at most.
ROUND_OFF = 1e-12

# The second reader: xml.etree and products of quaternions; nothing of the package.


def product(a, b):
    v, w = np.array(a[:3]), np.array(b[:3])
    return (*(a[3] * w + b[3] * v + np.cross(v, w)), a[3] * b[3] - v @ w)


def about(axis, angle):
    axis = np.array(axis, dtype=float)
    return (*(axis / np.linalg.norm(axis) * math.sin(angle / 2)), math.cos(angle / 2))


def matrix(xyz, q):
    q = np.array(q) / np.linalg.norm(q)
    back = (*-q[:3], q[3])
    T = np.eye(4)
    T[:3, :3] = np.array([product(product(q, (*e, 0.0)), back)[:3] for e in np.eye(3)]).T
    T[:3, 3] = xyz
    return T


def numbers(element, attribute, default):
    text = default if element is None else element.get(attribute, default)
    return [float(word) for word in text.split()]


def origin_of(joint):
    origin = joint.find('origin')
    roll, pitch, yaw = numbers(origin, 'rpy', '0 0 0')
    q = product(about((0, 0, 1), yaw), product(about((0, 1, 0), pitch), about((1, 0, 0), roll)))
    if origin is not None and origin.get('quat_xyzw'):
        q = numbers(origin, 'quat_xyzw', '')
    return matrix(numbers(origin, 'xyz', '0 0 0'), q)


def plain_pose(text, base, tip, positions):
    """Return the pose of a link in another above it, of joint positions by name."""
    root = ElementTree.fromstring(text)
    above = {joint.find('child').get('link'): joint for joint in root.iter('joint')}
    T = np.eye(4)
    while tip != base:
        joint = above[tip]
        value = positions.get(joint.get('name'), 0.0)
        mimic = joint.find('mimic')
        if mimic is not None:
            (multiplier,), (offset,) = (
                numbers(mimic, *pair) for pair in (('multiplier', '1'), ('offset', '0'))
            )
            value = multiplier * positions[mimic.get('joint')] + offset
        axis = numbers(joint.find('axis'), 'xyz', '1 0 0')
        moved = np.eye(4)
        if joint.get('type') == 'prismatic':
            moved[:3, 3] = value * np.array(axis) / np.linalg.norm(axis)
        elif joint.get('type') != 'fixed':
            moved = matrix((0, 0, 0), about(axis, value))
        T = origin_of(joint) @ moved @ T
        tip = joint.find('parent').get('link')
    return T


# URDFs by seed: every way of writing a rotation, axes of any length, joints that mimic.

QUARTERS = (
    '0.7071067811865476 0 0 0.7071067811865476',
    '0 -0.70711 0 0.70711',
    '0.5 0.5 -0.5 0.5',
    '0 0 2 0',
)


def words(values):
    return ' '.join(repr(float(value)) for value in values)


def written_urdf(seed):
    random = np.random.default_rng(seed)
    joints, count = [], int(random.integers(1, 8))
    for k in range(count + 1):
        rotation = (
            '',
            f'rpy="{words(random.uniform(-3, 3, 3))}"',
            f'quat_xyzw="{words(random.normal(size=4))}"',
            f'quat_xyzw="{random.choice(QUARTERS)}"',
            f'rpy="{random.choice(["1.5707963267948966 0 0", "0 0 -3.141592653589793"])}"',
        )[random.integers(5)]
        kind = 'fixed' if k == count else random.choice(['revolute', 'continuous', 'prismatic'])
        mimic = ''
        if (
            k > 1
            and kind != 'prismatic'
            and 'prismatic' not in joints[0]
            and random.random() < 0.2
        ):
            mimic = f'<mimic joint="j 0" multiplier="{random.uniform(-2, 2)!r}" offset="0.3"/>'
        joints.append(
            f'<joint name="j {k}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/>'
            f'<origin xyz="{words(random.uniform(-1, 1, 3))}" {rotation}/>'
            f'<axis xyz="{words(random.normal(size=3))}"/>{mimic}'
            '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        )
    links = ''.join(f'<link name="l{k}"/>' for k in range(count + 2))
    return f'<robot name="written" version="1.1">{links}{"".join(joints)}</robot>', count + 1


@pytest.mark.parametrize('seed', range(8))
def test_poses_are_those_of_a_second_reader(seed):
    text, tip = written_urdf(seed)
    found = ks.import_urdf(text, 'l0', f'l{tip}')
    random = np.random.default_rng(seed)
    for q in random.uniform(-1, 1, (4, found.robot.dof)):
        expected = plain_pose(text, 'l0', f'l{tip}', dict(zip(found.robot.joint_names, q)))
        np.testing.assert_allclose(
            ks.forward_kinematics(found.robot, q), expected, rtol=0, atol=ROUND_OFF
        )
    assert found.doubts == ()


# An arm of three joints, with one part of its second joint exchanged.

LIMIT = '<limit lower="-3" upper="3" effort="1" velocity="2"/>'


def arm(origin='<origin xyz="0.1 0 0.2"/>', limit=LIMIT, version='', more='', name='j'):
    head = f' version="{version}"' if version else ''
    joint = (
        '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>{3}'
        '<axis xyz="0 0 1"/>{4}</joint>\n'
    )
    first = '<origin xyz="0 0 0.3"/>'
    return (
        f'<robot name="arm"{head}>\n<link name="base"/><link name="a"/><link name="b"/>'
        '<link name="tool"/>\n'
        + joint.format(f'{name}1', 'base', 'a', first, LIMIT)
        + joint.format(f'{name}2', 'a', 'b', origin, limit + more)
        + joint.format(f'{name}3', 'b', 'tool', '<origin xyz="0.4 0 0" rpy="0.3 0 0"/>', LIMIT)
        + '</robot>'
    )


def doubts_of(text):
    return ks.import_urdf(text).doubts


def refusal(urdf):
    with pytest.raises(UrdfError) as caught:
        ks.load_robot(urdf) if isinstance(urdf, Path) else ks.import_urdf(urdf)
    return caught.value.fault


QUARTER = 'quat_xyzw="0.7071 0 0 0.7071"'
ORIGIN, OF_LIMIT = (f"<{tag}> of <joint name='j2'>" for tag in ('origin', 'limit'))


@pytest.mark.parametrize(
    ('attributes', 'version', 'roll'),
    [
        (QUARTER, '1.1', math.pi / 2),
        ('quat_xyzw="3 0 0 3"', '1.2', math.pi / 2),
        ('quat_xyzw="0 0 0 1"', '', 0.0),
        (f'rpy="1.5707963267948966 0 0" {QUARTER}', '1.1', math.pi / 2),
        (f'rpy="1.5707963267948966 0 0" {QUARTER}', '', math.pi / 2),
        ('rpy="0.2 0 0"', '1.1', 0.2),
        ('', '1.2', 0.0),
    ],
)
def test_a_rotation_is_read_by_version(attributes, version, roll):
    robot = ks.import_urdf(arm(f'<origin xyz="0.1 0 0.2" {attributes}/>', version=version)).robot
    same = ks.import_urdf(arm(f'<origin xyz="0.1 0 0.2" rpy="{roll!r} 0 0"/>')).robot
    q = [0.3, -0.5, 0.7]
    np.testing.assert_allclose(
        ks.forward_kinematics(robot, q), ks.forward_kinematics(same, q), rtol=0, atol=ROUND_OFF
    )


@pytest.mark.parametrize(
    ('attributes', 'version', 'code', 'words'),
    [
        (QUARTER, '', 'conflict', ('rpy 0 0 0', 'version="1.1"')),
        (QUARTER, '1.0', 'conflict', ('quat_xyzw 0.7071 0 0 0.7071',)),
        (f'rpy="0 0 1.57" {QUARTER}', '1.1', 'conflict', ('rpy 0 0 1.57', 'delete')),
        (f'rpy="0 0 1.57" {QUARTER}', '', 'conflict', ('delete',)),
        ('quat_xyzw="0 0 0 0"', '1.1', 'not-a-rotation', ('length 0',)),
        ('quat_xyzw="0 0 1"', '1.1', 'wrong-length', ('four',)),
        ('quat_xyzw="0, 0, 0, 1"', '1.1', 'decimal-comma', ("write '0 0 0 1'",)),
        ('quat_xyzw="0 0 nan 1"', '1.1', 'not-a-number', ("'nan'",)),
    ],
)
def test_a_rotation_of_two_readings_is_refused(attributes, version, code, words):
    fault = refusal(arm(f'<origin {attributes}/>', version=version))
    place = (4, "<origin> of <joint name='j2'>", code)
    assert (fault.line, fault.where, fault.code) == place
    assert all(word in fault.message for word in words)


@pytest.mark.parametrize(
    ('text', 'where', 'code', 'words'),
    [
        (arm(version='9.9'), "<robot name='arm'>", 'unknown-name', ("'9.9'", 'as 1.2', '1.1')),
        (arm(version='1'), "<robot name='arm'>", 'unknown-name', ("'1'",)),
        (arm('<origin xyz="0 0 1" quat="0 0 0 1"/>'), ORIGIN, 'unknown-key', ("'quat'",)),
        (arm('<origin xzy="0 0 1"/>'), ORIGIN, 'unknown-key', ("'xzy'", "'xyz'?")),
        (
            arm().replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1" rpy="1 0 0"/>', 1),
            "<axis> of <joint name='j1'>",
            'unknown-key',
            ("'rpy'",),
        ),
        (arm(limit=LIMIT.replace('effort', 'torque')), OF_LIMIT, 'unknown-key', ('torque',)),
        (
            arm(more='<mimic joint="j1" factor="2"/>'),
            "<mimic> of <joint name='j2'>",
            'unknown-key',
            ('factor',),
        ),
        (
            arm(limit=LIMIT.replace('effort', 'acceleration="5" effort')),
            OF_LIMIT,
            'newer-version',
            ('acceleration', '1.2'),
        ),
        (
            arm(f'<origin rpy="1.5708 0 0" {QUARTER}/>', version='1.1'),
            ORIGIN,
            'duplicate-key',
            ('rpy is read',),
        ),
        (arm('<origin xyz="0 0 1"/><origin xyz="?"/>'), ORIGIN, 'duplicate-key', ('first',)),
        (
            arm('<orgin xyz="0 0 1"/>'),
            "<orgin> of <joint name='j2'>",
            'unknown-key',
            ("'origin'?",),
        ),
    ],
)
def test_what_is_not_read_is_named(text, where, code, words):
    (doubt,) = doubts_of(text)
    assert (doubt.where, doubt.code) == (where, code)
    assert all(word in doubt.message for word in words)


def test_what_is_true_of_several_joints_is_said_once():
    text = arm().replace('effort=', 'current="1" effort=')
    (doubt,) = doubts_of(text)
    assert (doubt.line, doubt.where) == (3, "<limit> of <joint name='j1'>")
    assert '2 more' in doubt.message


@pytest.mark.parametrize(
    ('rates', 'version', 'expected', 'remarked'),
    [
        ('acceleration="5"', '1.2', 5.0, False),
        ('acceleration="5" deceleration="7"', '1.2', 5.0, True),
        ('acceleration="5" deceleration="3" jerk="9"', '1.2', 3.0, True),
        ('deceleration="4"', '1.2', 4.0, True),
        ('acceleration="0"', '1.2', math.inf, False),
        ('acceleration="inf"', '1.2', math.inf, False),
        ('acceleration="5"', '1.1', math.inf, False),
        ('', '1.2', math.inf, False),
    ],
)
def test_accelerations_are_those_of_the_robot_file(rates, version, expected, remarked):
    found = ks.import_urdf(arm(limit=LIMIT.replace('effort', f'{rates} effort'), version=version))
    assert found.robot.acceleration_limits.tolist() == [math.inf, expected, math.inf]
    assert any(one.startswith('j2:') and 'jerk' in one for one in found.remarks) == remarked
    assert np.array_equal(
        ks.robot_from_text(found.text).acceleration_limits, found.robot.acceleration_limits
    )


def test_an_acceleration_of_a_urdf_slows_a_stop():
    near = [0.0, 2.9, 0.0]
    limit = LIMIT.replace('effort', 'acceleration="{}" effort')
    slow, fast = (
        ks.scale(
            ks.import_urdf(arm(limit=limit.format(rate), version='1.2')).robot,
            *(near, [0.0, 1.0, 0.0]),
        )
        for rate in (1, 100)
    )
    assert slow.value < fast.value


# Units.


@pytest.mark.parametrize(
    ('text', 'line', 'phrases'),
    [
        (
            arm(limit=LIMIT.replace('3', '180')),
            4,
            ('28.6', 'degrees'),
        ),
        (arm(limit=LIMIT.replace('3', '90')), 4, ('degrees',)),
        (arm('<origin xyz="0 0 400"/>'), 4, ('400 m', 'millimetres')),
        (arm('<origin xyz="0 0 1" rpy="0 -90 0"/>'), 4, ('-90 rad',)),
        (arm(limit=LIMIT.replace('"2"', '"120"')), 4, ('120',)),
        (arm('<origin xyz="0 0 15"/>').replace('0.4 0 0', '12 0 0'), 1, ('m in all',)),
        (
            arm(limit='<limit lower="0" upper="1500"/>').replace(
                'j2" type="revolute', 'j2" type="prismatic'
            ),
            4,
            ('1500 m', 'millimetres'),
        ),
    ],
)
def test_numbers_in_other_units_are_asked_about(text, line, phrases):
    doubts = [one for one in doubts_of(text) if (one.line, one.code) == (line, 'wrong-unit')]
    for phrase in (*phrases, 'm and rad'):
        assert any(phrase in one.message for one in doubts)


@pytest.mark.parametrize(
    'text',
    [
        arm(limit=LIMIT.replace('3', '6.28318')),
        arm(limit=LIMIT.replace('3', '12.566')),
        arm('<origin xyz="0 0 12" rpy="6.2832 0 -3.1416"/>'),
        arm(limit=LIMIT.replace('"2"', '"31.4"')),
        arm(limit='<limit lower="0" upper="9" velocity="0" effort="0"/>').replace(
            'j2" type="revolute', 'j2" type="prismatic'
        ),
        arm(version='1.0'),
    ],
)
def test_usual_numbers_are_not_asked_about(text):
    assert doubts_of(text) == ()


def test_check_and_import_ask_about_units(tmp_path, capsys):
    path = tmp_path / 'degrees.urdf'
    path.write_text(arm('<origin rpy="90 0 0"/>', LIMIT.replace('3', '150')))
    assert main(['check', str(path)]) == 0
    assert main(['check', '--strict', str(path)]) == 1
    assert main(['import', '--urdf', str(path), '--out', str(tmp_path / 'arm.yaml')]) == 0
    err = capsys.readouterr().err
    for phrase in ('WARN <origin> of', ' 90 rad', "WARN <joint name='j2'>: limits of 23.87"):
        assert err.count(phrase) == 3


# Rounded angles and axes.

NOISE = '<axis xyz="2.2e-08 -4.4e-08 -1"/>'


@pytest.mark.parametrize(
    ('text', 'rows'),
    [
        (arm('<origin xyz="0.1 0 0.2" rpy="1.5708 -9.4e-08 0"/>'), ('pi/2',)),
        (arm().replace('<axis xyz="0 0 1"/>', '<axis xyz="1e-7 3 -2e-07"/>'), ('pi/2',)),
    ],
)
def test_check_proposes_to_round_what_import_rounds(text, rows, tmp_path, capsys):
    path, out = tmp_path / 'noise.urdf', tmp_path / 'out.yaml'
    path.write_text(text)
    assert main(['check', '--strict', str(path)]) == 0
    said = ' '.join(capsys.readouterr().out.split())
    assert f'--urdf {path} --base base --tip tool --round-angles --out arm.yaml' in said
    command = ['import', '--urdf', str(path), '--base', 'base', '--tip', 'tool', '--round-angles']
    assert main([*command, '--out', str(out)]) == 0
    assert '--round-angles' not in capsys.readouterr().err
    links = ks.load_robot(out).description.links
    assert len(links) == 3
    assert {row['alpha'].text.lstrip('-') for row in links} <= {*rows, '0', '0.3', 'pi'}
    q = [0.3, -0.5, 0.7]
    np.testing.assert_allclose(
        ks.forward_kinematics(out, q), ks.forward_kinematics(path, q), rtol=0, atol=1e-5
    )


@pytest.mark.parametrize('axis', ['0 0.001 1', '1e-5 0 1', '0.70710678 0 0.70710678'])
def test_an_axis_that_is_meant_stays(axis):
    text = arm().replace('<axis xyz="0 0 1"/>', f'<axis xyz="{axis}"/>')
    as_written, rounded = (ks.import_urdf(text, round_angles=rounds) for rounds in (False, True))
    assert not any('parts of pi' in one for one in as_written.remarks)
    assert rounded.certificate.rotation_error < ROUND_OFF


def test_axes_with_noise_have_named_factors_once_rounded(tmp_path, capsys):
    out = tmp_path / 'out.yaml'
    first, rest = arm('<origin xyz="0.05 0 0.1" rpy="1.5707963267948966 0 0"/>').split('j2', 1)
    tool = (
        '<link name="tip"/><joint name="t" type="fixed"><parent link="tool"/><child link="tip"/>'
        '<origin xyz="0.3 0 0.02"/></joint></robot>'
    )
    rest = rest.replace('rpy="0.3 0 0"', '').replace('<axis xyz="0 0 1"/>', NOISE)
    text = f'{first}j2{rest}'.replace('</robot>', tool)
    text = '8.8e-08'.join(text.rsplit('2.2e-08', 1))
    assert len(ks.import_urdf(text).robot.description.links) > 3
    rounded = ks.import_urdf(text, round_angles=True)
    out.write_text(rounded.text)
    assert main(['derive', str(out), '--write']) == 0
    robot = ks.load_robot(out)
    assert len(robot.description.links) == 3
    assert [one.name for one in robot.description.singularity.factors] == ['shoulder', 'elbow']


# Encodings.

KANJI = '<!-- 表示 関節 ソ -->'


@pytest.mark.parametrize(
    ('declared', 'codec'),
    [
        ('SHIFT-JIS', 'cp932'),
        ('x-sjis', 'cp932'),
        ('GB2312', 'gb2312'),
        ('GB18030', 'gb18030'),
        ('EUC-JP', 'euc_jp'),
        ('Big5', 'big5'),
        ('UTF-8', 'utf-8'),
        ('utf-8', 'utf-8-sig'),
        ('UTF-16', 'utf-16'),
        ('iso-8859-1', 'iso-8859-1'),
        ('GB2312', 'utf-8'),
    ],
)
def test_files_of_other_encodings_are_read(declared, codec):
    comment = {'iso-8859-1': '<!-- Gelenk für -->', 'gb2312': '<!-- 关节 -->'}.get(codec, KANJI)
    comment = '<!-- 關節 -->' if codec == 'big5' else comment
    text = f'<?xml version="1.0" encoding="{declared}"?>\n{comment}{arm()}'
    root = parse_urdf(text.encode(codec), 'arm.urdf')
    assert [joint.attributes['name'] for joint in root.all('joint')] == ['j1', 'j2', 'j3']


@pytest.mark.parametrize(
    ('declaration', 'codec'),
    [
        ('', 'cp932'),
        ('<?xml version="1.0"?>', 'gb2312'),
        ('<?xml version="1.0" encoding="UTF-8"?>', 'cp932'),
        ('<?xml version="1.0" encoding="EUC-JP"?>', 'cp932'),
    ],
)
def test_other_bytes_are_refused_with_what_to_type(declaration, codec, tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_bytes(f'{declaration}\n<!-- 表示 -->{arm()}'.encode(codec))
    fault = refusal(path)
    assert (fault.file, fault.line, fault.code) == (str(path), 2, 'wrong-encoding')
    assert f'iconv -f SHIFT_JIS -t UTF-8 {path}' in fault.message


def test_a_comment_before_the_declaration_is_told_how_to_move():
    fault = refusal(f'<!-- an arm -->\n<?xml version="1.0"?>{arm()}')
    assert (fault.line, fault.code) == (2, 'syntax')
    assert '; delete the text before <?xml' in fault.message


# Names with spaces.


def test_names_with_spaces_go_through_every_file(tmp_path, capsys):
    path, yaml, again = (tmp_path / name for name in ('arm.urdf', 'arm.yaml', 'again.urdf'))
    path.write_text(arm(name='Revolute '))
    assert main(['import', '--urdf', str(path), '--out', str(yaml)]) == 0
    assert main(['check', '--strict', str(yaml)]) == 0
    assert main(['export', str(yaml), '--urdf', str(again)]) == 0
    names = ('Revolute 1', 'Revolute 2', 'Revolute 3')
    for file in (path, yaml, again):
        assert ks.load_robot(file).joint_names == names
        assert main(['fk', '--robot', str(file), '--q', '0.1,0.2,0.3']) == 0
    assert 'Revolute 2' in capsys.readouterr().out


def test_an_order_of_names_with_spaces_survives_a_urdf(tmp_path):
    yaml = tmp_path / 'arm.yaml'
    yaml.write_text(
        'robot: arm\nconvention: standard\njoints:\n'
        '  - {name: last joint, variable: q2, type: revolute}\n'
        '  - {name: first joint, variable: q1, type: revolute}\n'
        'links:\n  - {a: 0.4, alpha: 0, d: 0, theta: q1}\n'
        '  - {a: 0.3, alpha: 0, d: 0, theta: q2}\n'
    )
    robot = ks.load_robot(yaml)
    text = ks.export_urdf(robot)
    other = ks.import_urdf(text, 'base_link', 'tool0').robot
    assert other.joint_names == robot.joint_names == ('last joint', 'first joint')
    old = text.replace('last joint', 'last').replace('first joint', 'first')
    spaced = ks.import_urdf(old.replace('"last,first"', '"last first"'), 'base_link', 'tool0')
    assert spaced.robot.joint_names == ('last', 'first')
