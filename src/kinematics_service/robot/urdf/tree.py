# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the tree of links and joints of a URDF, and find the path from one link to another."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple

from ..file.text.entries import did_you_mean, meant_by
from ..file.text.fault_report import quoted
from .document import XmlElement, listed_names, refuse
from .elements import VERSIONS


class UrdfPath(NamedTuple):
    """
    The joints on the path between two links of the tree. `up` goes from the first link up to a
    link above both. `down` goes from that link down to the second link.
    """

    up: tuple[XmlElement, ...]
    down: tuple[XmlElement, ...]


@dataclass(frozen=True)
class UrdfTree:
    """
    The tree of the links of a URDF and the joints between them.

    When the tree is read, only the names of links and joints and the elements `<parent>` and
    `<child>` of joints are checked.

    Parameters
    ----------
    root
        The element `<robot>`.
    links, joints
        Elements by name, in the order of the file. A leading slash is removed from names of links,
        as robot_state_publisher does, because tf2 refuses the slash.
    above
        For each link, the joints whose child is this link. In a valid tree, each link has at most
        one such joint.
    """

    root: XmlElement
    links: Mapping[str, XmlElement]
    joints: Mapping[str, XmlElement]
    above: Mapping[str, Sequence[XmlElement]]

    @property
    def version(self) -> str:
        """
        Return the version of URDF that the file declares, or the newest version if the declared
        version is unknown.
        """
        written = self.root.attributes.get('version', VERSIONS[0])
        return written if written in VERSIONS else VERSIONS[-1]

    def path(self, base: str, tip: str) -> UrdfPath:
        """
        Return the joints on the path from the base link to the tip link.

        Raises
        ------
        UrdfError
            A link does not exist or has two parents, no link is above both, or the tip is above
            the base.
        """
        base, tip = base.removeprefix('/'), tip.removeprefix('/')
        for link, option in ((base, 'base'), (tip, 'tip')):
            if link not in self.links:
                hint = did_you_mean(meant_by(link, tuple(self.links)))
                names = listed_names(self.links)
                message = f'unknown link {quoted(link)} for the {option}{hint} (links: {names})'
                self.root.refuse(message, 'unknown-name')
        joints = self._joints_above(tip, base)
        links = [tip, *(end_of(joint, 'parent') for joint in joints)]
        if links[-1] == base:
            return UrdfPath((), tuple(reversed(joints)))
        up = self._joints_above(base, *links)
        meets = end_of(up[-1], 'parent') if up else base
        if meets not in links[1:]:
            above = f'; it is below: {listed_names(links[1:])}' if links[1:] else ''
            self.root.refuse(f'{quoted(tip)} is not below {quoted(base)}{above}', 'wrong-order')
        return UrdfPath(up, tuple(reversed(joints[: links.index(meets)])))

    def _joints_above(self, link: str, *ends: str) -> tuple[XmlElement, ...]:
        # Return the joints on the path upwards from a link. The path ends at the first link that
        # is in `ends`, or at the root if the path has no link in `ends`.
        joints: list[XmlElement] = []
        while link not in ends and (above := self.above.get(link, ())):
            if len(above) > 1:
                names = ' and '.join(quoted(joint.attributes['name']) for joint in above)
                above[1].refuse(
                    f'a loop: link {quoted(link)} is the child of {names}; '
                    'delete one of these joints',
                    'loop',
                )
            joints.append(above[0])
            link = end_of(above[0], 'parent')
        return tuple(joints)


def end_of(joint: XmlElement, end: str) -> str:
    """
    Return the link at one end of a joint, `parent` or `child`.

    Raises
    ------
    UrdfError
        The joint does not name its parent or child link.
    """
    element = joint.first(end)
    link = None if element is None else element.attributes.get('link')
    if not link:
        joint.refuse(f'<{end} link="..."/> is missing', 'missing-key')
    return link.removeprefix('/')


def read_tree(root: XmlElement) -> UrdfTree:
    """
    Read the tree of links and joints of a URDF, and check that the tree has no cycle.

    Raises
    ------
    UrdfError
        A link or joint has no name, two links or joints have the same name, a joint names a link
        that does not exist, or a link is below itself.
    """
    links, joints = _named(root, 'link'), _named(root, 'joint')
    if not links:
        refuse(root.file, 'the file has no <link>', 'missing-key')
    above: dict[str, list[XmlElement]] = {}
    for joint in joints.values():
        for end in ('parent', 'child'):
            if end_of(joint, end) not in links:
                names = listed_names(links)
                message = f'unknown {end} {quoted(end_of(joint, end))} (links: {names})'
                joint.refuse(message, 'unknown-name')
        above.setdefault(end_of(joint, 'child'), []).append(joint)
    tree = UrdfTree(root, links, joints, above)
    _refuse_circle(tree)
    return tree


def _refuse_circle(tree: UrdfTree) -> None:
    parents = {
        link: [end_of(joint, 'parent') for joint in joints] for link, joints in tree.above.items()
    }
    try:
        TopologicalSorter(parents).prepare()
    except CycleError as error:
        # The names of the links in the cycle; after each link comes its parent.
        upwards = error.args[1][:0:-1]
        first = upwards.index(next(link for link in tree.links if link in upwards))
        circle = [*upwards[first:], *upwards[: first + 1]]
        above = reversed(tree.above[circle[-2]])
        joint = next(joint for joint in above if end_of(joint, 'parent') == circle[0])
        message = f'a loop: link {quoted(circle[0])} is below itself ({listed_names(circle)})'
        joint.refuse(message, 'loop')


def _named(root: XmlElement, tag: str) -> dict[str, XmlElement]:
    elements: dict[str, XmlElement] = {}
    for element in root.all(tag):
        name = element.attributes.get('name', '')
        name = name.removeprefix('/') if tag == 'link' else name
        if not name:
            element.refuse('the attribute name is missing', 'missing-key')
        if name in elements:
            message = f'line {elements[name].line} has the same name; rename one of the two'
            element.refuse(message, 'duplicate-name')
        elements[name] = element
    return elements
