# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write a robot as URDF without loss: every frame of the table becomes a link."""

import math
from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np

from ...kernel import Floats
from ...rigid_motion import exact_rpy
from ...typography import number_text
from ...version import __version__
from ..loops import opened
from ..robot import AnyRobot, Robot, as_robot, build_robot
from .elements import AS_IN_THE_FILE, EXTENSION, UNLIMITED, FrameNames, PlannedJoint, UrdfPlan
from .plan import plan_of
from .shapes import Shape, shapes_of

# Colours (red, green, blue, alpha) of Okabe and Ito (2008), which colour-blind people can
# distinguish.
COLOURS = {
    'rod': (0.6, 0.6, 0.6, 1.0),
    'turning': (0.0, 0.447, 0.698, 1.0),
    'sliding': (0.902, 0.624, 0.0, 1.0),
    'tool': (0.8, 0.475, 0.655, 1.0),
}
SIZES = {'cylinder': ('radius', 'length'), 'sphere': ('radius',)}


def export_urdf(robot: AnyRobot, names: FrameNames = AS_IN_THE_FILE) -> str:
    """
    Return the URDF of a robot as XML text.

    The root link is the base frame, and the last leaf is the tool frame. Each point of the robot
    file is a leaf with the name of the point. `<robot name>_frame_<i>` are the frames of the
    table, as `link_frames` returns them. Numbers have enough digits to be read back exactly. The
    elements `<inertial>` and `<collision>` are missing, because the robot file has no such data.
    Closed loops are left out, and passive joints become ordinary joints.

    Parameters
    ----------
    robot
        The arm.
    names
        Names of the base and tool frames, and the prefix of all frames.
    """
    robot = as_robot(robot)
    loops = [without_loops(robot)] if robot.passive_joint_names else []
    if loops:
        robot = build_robot(opened(robot.description))
    plan = plan_of(robot, names)
    root = ElementTree.Element('robot', name=robot.name)
    for sentence in (*_about(robot, plan), *loops):
        root.append(ElementTree.Comment(_comment(sentence)))
    if plan.joint_order:
        ElementTree.SubElement(root, EXTENSION, joint_order=','.join(plan.joint_order))
    for name, colour in COLOURS.items():
        material = ElementTree.SubElement(root, 'material', name=f'{robot.name}_{name}')
        ElementTree.SubElement(material, 'color', rgba=_texts(colour))
    shapes = shapes_of(plan, robot.singularity.task.length)
    for link in plan.links:
        element = ElementTree.SubElement(root, 'link', name=link)
        for shape in shapes[link]:
            _add_visual(element, shape, f'{robot.name}_{shape.colour}')
    for joint in plan.joints:
        _add_joint(root, joint)
    ElementTree.indent(root)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'


def without_loops(robot: Robot) -> str:
    """
    Return a sentence that names the closed loops of an arm, which the URDF of the arm leaves out.
    """
    loops = ', '.join(repr(loop.name) for loop in robot.description.loops)
    passive = ', '.join(robot.passive_joint_names)
    return (
        f'URDF has no closed loops, so the second chain of {loops} is left out. The passive '
        f'joints of the table ({passive}) become ordinary joints, which move only if their '
        'positions are published.'
    )


def _about(robot: Robot, plan: UrdfPlan) -> Iterable[str]:
    table = f'its {robot.convention} table'
    yield f'{robot.name}, made from {table} by kinematics_service {__version__}.'
    if robot.source:
        yield f'Source of the table: {robot.source}'
    yield (
        f'{plan.frames[0]} to {plan.frames[-1]} are the frames of the table. The shapes only '
        'mark joints and links and are not their outline; inertia and collision shapes are not '
        'known.'
    )
    if any(joint.limit for joint in plan.joints):
        yield (
            'URDF asks for effort, velocity and limits where the robot file may have none: '
            f'{number_text(UNLIMITED)} stands for not known, or without limit; effort is never '
            'known.'
        )
    if any(joint.mimic for joint in plan.joints):
        yield (
            'Joints that mimic are the other terms of a row of the table; they are not joints of '
            'the arm.'
        )


def _comment(sentence: str) -> str:
    # An XML comment may not contain `--` or end with a hyphen. So put a space between two hyphens,
    # and a space at the end.
    return f' {sentence.replace("--", "- -").replace("--", "- -")} '


def _texts(values: Iterable[float]) -> str:
    return ' '.join(number_text(value) for value in values)


def _add_origin(parent: ElementTree.Element, T: Floats) -> None:
    if not np.array_equal(T, np.eye(4)):
        rpy = exact_rpy(T[:3, :3])
        ElementTree.SubElement(parent, 'origin', xyz=_texts(T[:3, 3]), rpy=_texts(rpy))


def _add_visual(link: ElementTree.Element, shape: Shape, material: str) -> None:
    visual = ElementTree.SubElement(link, 'visual')
    _add_origin(visual, shape.pose)
    geometry = ElementTree.SubElement(visual, 'geometry')
    if shape.kind == 'box':
        ElementTree.SubElement(geometry, 'box', size=_texts(shape.size))
    else:
        sizes = dict(zip(SIZES[shape.kind], map(number_text, shape.size)))
        ElementTree.SubElement(geometry, shape.kind, sizes)
    ElementTree.SubElement(visual, 'material', name=material)


def _add_joint(root: ElementTree.Element, joint: PlannedJoint) -> None:
    element = ElementTree.SubElement(root, 'joint', name=joint.name, type=joint.type)
    _add_origin(element, joint.origin)
    ElementTree.SubElement(element, 'parent', link=joint.parent)
    ElementTree.SubElement(element, 'child', link=joint.child)
    if joint.type == 'fixed':
        return
    ElementTree.SubElement(element, 'axis', xyz=f'0 0 {math.copysign(1.0, joint.sign):.0f}')
    if joint.limit:
        ends = {'lower': joint.limit.lower, 'upper': joint.limit.upper}
        limit = {name: number_text(end) for name, end in ends.items() if end is not None}
        limit |= {'effort': number_text(UNLIMITED), 'velocity': number_text(joint.limit.velocity)}
        ElementTree.SubElement(element, 'limit', limit)
    if joint.mimic:
        multiplier = number_text(joint.mimic.multiplier)
        ElementTree.SubElement(element, 'mimic', joint=joint.mimic.joint, multiplier=multiplier)
