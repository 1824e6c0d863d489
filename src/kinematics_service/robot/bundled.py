# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""List the bundled robots, and find the file of a robot by its name or path."""

import difflib
import os
import re
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import NamedTuple

from ..errors import RobotNotFoundError
from .file.translation import translator_of

# The bundled robots in groups: the title of each group, and the names of its robots. The command
# `robots` lists the groups in this order, then the robots without a group.
GROUPS: Mapping[str, tuple[str, ...]] = {
    title: tuple(names.split())
    for title, names in {
        'Industrial and research arms': 'crx10ia_l fr3 gen3_lite kinova_gen3 kuka_iiwa14 panda '
        'puma560 scara_hsr065 so101 ur3e ur5e ur10e xarm6 xarm7',
        'Machines with closed loops': 'excavator flexpicker',
        'Textbook and course arms': 'planar_2r planar_3r anthropomorphic_3r craig_3r '
        'spherical_rrp rrp_elementary six_joint_dh six_joint_dh_unit',
        'The same arm in several tables': 'offset_stanford_shape offset_stanford_dh '
        'offset_stanford_printed parallelogram_left parallelogram_right',
        'Course arms with closed loops': 'four_bar_arm five_bar crank_slider',
    }.items()
}
OTHERS = 'Others'
# The node can read the URDF of a robot from a ROS topic. The robot argument for such a topic
# begins with this prefix.
TOPIC = 'topic:'
YAML = ('.yaml', '.yml')


def _folder() -> Path:
    try:
        return Path(str(resources.files('kinematics_service.config')))
    except ModuleNotFoundError:
        # With `colcon build --symlink-install` the package runs from the checkout. In the
        # checkout, the folder `config` is beside the folder `src`, not in the package.
        return Path(__file__).resolve().parents[3] / 'config'


def bundled_robots() -> Mapping[str, Path]:
    """Return the files of the bundled robots by name, in alphabetical order."""
    return {path.stem: path for path in sorted(_folder().glob('*.yaml'))}


def grouped_robots() -> Mapping[str, Mapping[str, Path]]:
    """
    Return the files of the bundled robots by group and name, in the order that the command
    `robots` lists them.
    """
    bundled = bundled_robots()
    groups = {
        title: {name: bundled[name] for name in names if name in bundled}
        for title, names in GROUPS.items()
    }
    grouped = {name for group in groups.values() for name in group}
    others = {name: path for name, path in bundled.items() if name not in grouped}
    return {**groups, OTHERS: others} if others else groups


class RobotSource(NamedTuple):
    """
    The file that describes a robot, and the names of the two ends of the arm.

    Attributes
    ----------
    base, tip
        Names of the ends; empty if the user gave no names. In a URDF the ends are links: the arm
        goes from the link `base` to the link `tip`. In a cell (a file with several arms) the ends
        are frames: the robot's pose is the pose of the frame `tip` in the frame `base`. The frame
        `left` is the tool of the arm `left`. The frame `left/elbow` is the point `elbow` of this
        arm.
    """

    file: Path
    base: str = ''
    tip: str = ''


def find_robot_file(name: str | os.PathLike[str]) -> Path:
    """
    Return the path of the file of a robot, given its bundled name or a path.

    Raises
    ------
    RobotNotFoundError
        The name is neither a file nor a bundled robot; the message lists the bundled names.
    """
    return find_robot(name).file


def find_robot(name: str | os.PathLike[str]) -> RobotSource:
    """
    Return the file of a robot and the two ends of the arm, given a text that names the robot.

    The text is a bundled name, a path, or FILE:BASE:TIP. If FILE is a URDF, BASE and TIP are
    links. If FILE is a cell (a file with several arms), BASE and TIP are arms, or points of arms
    such as `left/elbow`.

    Raises
    ------
    RobotNotFoundError
        The name is neither a file nor a bundled robot; the message lists the bundled names.
    """
    bundled = bundled_robots()
    known = tuple(bundled)
    if not isinstance(name, str | os.PathLike):
        raise RobotNotFoundError(
            'robot must be a Robot, the name of a bundled robot or the path of a robot file, '
            f'not {type(name).__name__}',
            repr(name),
            known,
            code='wrong-type',
        )
    text = os.fspath(name)
    if text in bundled:
        return RobotSource(bundled[text])
    path = Path(text)
    whole, *ends = split_ends(text)
    if (translator_of(whole) or whole.endswith(YAML)) and not path.exists():
        return RobotSource(Path(whole), *ends)
    if text.startswith(TOPIC):
        sentence = f'{text}: only the node takes a robot from a topic; give a file'
        raise RobotNotFoundError(sentence, text, known, code='unsupported')
    looks_like_a_path = text.endswith(YAML) or bool(translator_of(text)) or path.name != text
    if path.exists() or looks_like_a_path:
        return RobotSource(path)
    near = difflib.get_close_matches(text.lower(), bundled, n=1)
    hint = f'did you mean {near[0]!r}? ' if near else ''
    if near and _other_model(text, near[0]):
        hint = f'there is no {text}; {near[0]} is another arm; '
    accepted = f'a robot file, a URDF or one of: {", ".join(known)}'
    raise RobotNotFoundError(f'no robot {text!r}: {hint}give {accepted}', text, known)


def _other_model(text: str, name: str) -> bool:
    # Return whether two similar robot names probably mean two models. They do if the digits in the
    # two names differ (ur5, ur10), or if one name has additional letters at the end (ur5, ur5e).
    # Otherwise one of the names probably has a typing mistake, for example two swapped digits.
    (digits, behind), (others, other_behind) = (
        (sorted(re.findall(r'\d', robot_name)), re.sub(r'^.*\d|[\W_]', '', robot_name.lower()))
        for robot_name in (text, name)
    )
    lacks = behind.startswith(other_behind) or other_behind.startswith(behind)
    return bool(digits) and (digits != others or (lacks and behind != other_behind))


def split_ends(name: str) -> tuple[str, str, str]:
    """Return SOURCE, BASE and TIP of `SOURCE:BASE:TIP`; BASE and TIP are empty if not given."""
    source, *ends = name.removeprefix(TOPIC).rsplit(':', 2)
    if len(ends) != 2:
        return name, '', ''
    return name.removesuffix(':'.join(['', *ends])), ends[0], ends[1]
