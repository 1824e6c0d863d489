# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Where the arm of a URDF ends if nobody says it: at its hand, and never in a finger.
"""

import pytest
from refusal import refused

import kinematics_service as ks
from kinematics_service.errors import UrdfError
from kinematics_service.robot.urdf.chain import read_chain
from kinematics_service.robot.urdf.document import parse_urdf
from kinematics_service.robot.urdf.ends import chain_ends
from kinematics_service.robot.urdf.tree import read_tree

LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def tree(*joints):
    """Return a URDF of joints (name, parent, child, and type if it is not revolute)."""
    links = dict.fromkeys(link for joint in joints for link in joint[1:3])
    return '\n'.join(
        [
            '<robot name="r">',
            *(f'<link name="{link}"/>' for link in links),
            *(
                f'<joint name="{name}" type="{kind[0] if kind else "revolute"}">'
                f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0.1 0 0.1"/>'
                f'{kind[1] if len(kind) > 1 else ""}{LIMIT}</joint>'
                for name, parent, child, *kind in joints
            ),
            '</robot>',
        ]
    )


def serial(count, prefix='j', base='base'):
    """Return joints one after the other, to the link `<prefix><count>`."""
    links = [base, *(f'{prefix}{k}' for k in range(1, count + 1))]
    return tuple((f'{prefix}oint_{k}', *ends) for k, ends in enumerate(zip(links, links[1:]), 1))


def limb(name, base, *names):
    """Return moving joints and links of the same names, one after the other."""
    links = [base, *(f'{name}_{one}' for one in names)]
    return tuple((f'{name}_{one}_joint', *ends) for one, ends in zip(names, zip(links, links[1:])))


FRAME = ('frame', 'j5', 'gripper_frame', 'fixed')
TOOL = ('mount', 'j6', 'tool0', 'fixed')
CAMERA = ('eye', 'j6', 'camera_link', 'fixed')
FOLLOWS = '<mimic joint="left_finger_joint"/>'

# The joints of a URDF, the tip, the number of moving joints, and the first joint of the hand.
HANDS = {
    'one jaw': (
        (*serial(5), ('gripper', 'j5', 'moving_jaw'), FRAME),
        'gripper_frame',
        5,
        'gripper',
    ),
    'one jaw, no frame': ((*serial(5), ('6', 'j5', 'Moving_Jaw_08d-v1')), 'j5', 5, '6'),
    'the still jaw too': (
        (*serial(4), ('Wrist_Roll', 'j4', 'Fixed_Jaw'), ('Jaw', 'Fixed_Jaw', 'Moving_Jaw')),
        'Fixed_Jaw',
        5,
        'Jaw',
    ),
    'a gripper joint': (
        (*serial(6), ('r_gripper', 'j6', 'r_tip', 'prismatic')),
        'j6',
        6,
        'r_grip',
    ),
    'a wrist of the gripper': (
        (*serial(4), ('gripper_roll', 'j4', 'gripper'), ('left_claw', 'gripper', 'a')),
        'gripper',
        5,
        'left_claw',
    ),
    'a thumb and fingers': (
        (
            *serial(7),
            *limb('th', 'j7', 'a', 'b'),
            *limb('ff', 'j7', 'a'),
            *limb('mf', 'j7', 'a'),
            ('e', 'j7', 'L_ee', 'fixed'),
        ),
        'L_ee',
        7,
        'th_a_joint',
    ),
    'five fingers by their branches': (
        (*serial(7), *(one for k in range(5) for one in limb(f'x{k}', 'j7', 'a', 'b', 'c'))),
        'j7',
        7,
        'x0_a_joint',
    ),
    'one of two fingers named': (
        (*serial(6), *limb('thumb', 'j6', 'a', 'b', 'c'), *limb('index', 'j6', 'a', 'b')),
        'j6',
        6,
        'thumb_a',
    ),
    'fingers that mimic': (
        (
            *serial(6),
            TOOL,
            ('left_finger_joint', 'j6', 'left', 'prismatic'),
            ('right_finger_joint', 'j6', 'right', 'prismatic', FOLLOWS),
        ),
        'tool0',
        6,
        'left_finger_joint',
    ),
    'knuckles in a row': (
        (*serial(6), ('left_knuckle', 'j6', 'a'), ('left_inner', 'a', 'left_finger')),
        'j6',
        6,
        'left_knuckle',
    ),
    'two jaws without names': (
        (*serial(6), ('joint_7', 'j6', 'l7', 'prismatic'), ('joint_8', 'j6', 'l8', 'prismatic')),
        'j6',
        6,
        'joint_7',
    ),
    'a frame of the tool before the last joint': (
        (*serial(6), FRAME),
        'gripper_frame',
        5,
        'joint_6',
    ),
    'a hand on a wrist': (
        (*serial(2), *limb('thumb', 'j2', 'a', 'b', 'c', 'd'), *limb('ring', 'j2', 'a', 'b')),
        'j2',
        2,
        'thumb_a',
    ),
    'the arm with fewer fingers': (
        (
            ('torso', 'base', 'chest'),
            *serial(5, 'j', 'chest'),
            *limb('thumb', 'j5', 'a', 'b', 'c'),
            *serial(6, 'k', 'chest'),
            ('k_jaw', 'k6', 'k_part'),
        ),
        'k6',
        7,
        'k_jaw',
    ),
}
ARMS = {
    'six joints': ((*serial(6), TOOL), 'tool0', 6),
    'a camera first in the file': ((*serial(6), CAMERA, TOOL), 'tool0', 6),
    'a camera on the forearm': ((*serial(6), TOOL, ('eye', 'j3', 'camera', 'fixed')), 'tool0', 6),
    'a camera that tilts': ((*serial(6), TOOL, ('tilt', 'j4', 'camera')), 'tool0', 6),
    'a short branch': ((*serial(7), ('lid', 'j4', 'cover')), 'j7', 7),
    'two arms of a trunk': (
        (('torso', 'base', 'chest'), *serial(6, 'l', 'chest'), *serial(6, 'r', 'chest')),
        'l6',
        7,
    ),
    'a finger alone': (
        (('finger_base', 'palm', 'a'), ('finger_mid', 'a', 'b'), ('finger_end', 'b', 'c')),
        'c',
        3,
    ),
    'wheels of a mobile base': (
        (
            *(
                ('x', 'world', 'u', 'prismatic'),
                ('y', 'u', 'v', 'prismatic'),
                ('yaw', 'v', 'cart'),
            ),
            *((f'wheel_{k}', 'cart', f'w{k}', 'continuous') for k in range(4)),
            *serial(6, 'j', 'cart'),
        ),
        'j6',
        9,
    ),
    'a wrist called gripper': (
        (*serial(5), ('wrist_to_gripper', 'j5', 'gripper'), ('t', 'gripper', 'tcp', 'fixed')),
        'tcp',
        6,
    ),
    'a spindle': ((*serial(5), ('spindle', 'j5', 'drill', 'continuous')), 'drill', 6),
    'every joint of a gripper': (serial(3, 'gripper_'), 'gripper_3', 3),
    'a slide and a turn': ((('z', 'base', 'c', 'prismatic'), ('a', 'c', 'd')), 'd', 2),
}


@pytest.mark.parametrize(('joints', 'tip', 'count', 'hand'), HANDS.values(), ids=list(HANDS))
def test_an_arm_ends_at_its_hand(joints, tip, count, hand):
    read = read_tree(parse_urdf(tree(*joints).encode(), 'arm.urdf'))
    base, end, (doubt,) = chain_ends(read)
    assert (end, len(read_chain(read, base, end).variables)) == (tip, count)
    assert doubt.code == 'chosen-chain'
    assert f'to {tip}, with {count} moving' in doubt.message
    assert f"'{hand}" in doubt.message.partition(', the first one of a hand')[0]
    # How to choose otherwise, and what that gives.
    _, base, other = doubt.message.rpartition('write ')[2].split(':')
    assert len(read_chain(read, base, other).variables) > count


@pytest.mark.parametrize(('joints', 'tip', 'count'), ARMS.values(), ids=list(ARMS))
def test_an_arm_without_a_hand_ends_where_its_last_joint_leads(joints, tip, count):
    read = read_tree(parse_urdf(tree(*joints).encode(), 'arm.urdf'))
    base, end, doubts = chain_ends(read)
    assert (end, len(read_chain(read, base, end).variables)) == (tip, count)
    assert not any('of a hand' in doubt.message for doubt in doubts)


@pytest.mark.parametrize(
    ('joints', 'hand', 'limb_tip'),
    [
        # A column with two short arms, or an arm with two long fingers.
        (
            (*serial(4), *limb('p', 'j4', 'a', 'b', 'c'), *limb('q', 'j4', 'a', 'b', 'c')),
            'j4',
            'p_c',
        ),
        # An arm with something on its forearm, or a thumb and a finger.
        ((*serial(4), *limb('p', 'j4', 'a', 'b'), *limb('q', 'j4', 'a')), 'j4', 'p_b'),
        ((*serial(5), *limb('p', 'j5', 'a', 'b', 'c'), *limb('q', 'j5', 'a', 'b')), 'j5', 'p_c'),
    ],
)
def test_branches_of_two_readings_are_refused_with_both(joints, hand, limb_tip):
    with refused(UrdfError, 'ambiguous', "'p_a_joint' and 'q_a_joint'") as caught:
        ks.import_urdf(tree(*joints))
    for tip in (hand, limb_tip):
        assert f' <text>:base:{tip}' in str(caught.value)
    for tip in (hand, limb_tip):
        read = read_tree(parse_urdf(tree(*joints).encode(), 'arm.urdf'))
        assert chain_ends(read, tip=tip) == chain_ends(read, 'base', tip) == ('base', tip, ())


# Joints that move freely.

CUT = (
    *serial(3),
    ('free', 'j3', 'k', 'floating'),
    *serial(2, 'k', 'k'),
)


@pytest.mark.parametrize(
    ('joints', 'ends', 'cut'),
    [
        (CUT, ('base', 'j3'), True),
        ((*serial(1), ('free', 'j1', 'k', 'planar'), *serial(2, 'k', 'k')), ('k', 'k2'), True),
        # Nothing moves above it, or below it: a mobile base, an object that is held.
        ((('free', 'world', 'base', 'floating'), *serial(3)), ('base', 'j3'), False),
        ((*serial(3), ('free', 'j3', 'cup', 'floating')), ('base', 'j3'), False),
    ],
)
def test_a_free_joint_that_cuts_a_chain_is_named(joints, ends, cut):
    found = ks.import_urdf(tree(*joints))
    assert (found.robot.base_frame, found.robot.tool_frame) == ends
    cuts = [doubt for doubt in found.doubts if doubt.code == 'unsupported']
    assert len(cuts) == cut
    for doubt in cuts:
        assert doubt.where == "<joint name='free'>"
        assert 'joint_1' in doubt.message


def test_one_named_end_of_a_chain_that_is_cut():
    (doubt,) = ks.import_urdf(tree(*CUT), tip='k2').doubts
    assert "<joint name='free'>: a floating joint" in str(doubt)
    assert ks.import_urdf(tree(*CUT), 'k', 'k2').doubts == ()
