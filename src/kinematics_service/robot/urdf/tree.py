"""The links and joints of a URDF, and the way from one link to another."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple

from ...errors import UrdfError
from ..file.text.entries import did_you_mean, meant_by
from ..file.text.fault_report import quoted
from .document import XmlElement, listed_names
from .elements import VERSIONS


class UrdfWay(NamedTuple):
    """Joints from one link to another: first up to a link above both, then down from there."""

    up: tuple[XmlElement, ...]
    down: tuple[XmlElement, ...]


@dataclass(frozen=True)
class UrdfTree:
    """
    Parents and children of the links; the rest of the file has not been checked.

    Parameters
    ----------
    root
        The element `<robot>`.
    links, joints
        Elements by name, in the order of the file; links without a leading slash, which tf2
        refuses in a frame and robot_state_publisher takes off.
    above
        The joints that have a link as their child; in a tree one or none.
    """

    root: XmlElement
    links: Mapping[str, XmlElement]
    joints: Mapping[str, XmlElement]
    above: Mapping[str, Sequence[XmlElement]]

    @property
    def version(self) -> str:
        """Return the version of the file; the newest in place of one that is not known."""
        written = self.root.attributes.get('version', VERSIONS[0])
        return written if written in VERSIONS else VERSIONS[-1]

    def way(self, base: str, tip: str) -> UrdfWay:
        """
        Return the joints from the base link to the tip link.

        Raises
        ------
        UrdfError
            A link does not exist or has two parents; no link is above both; the tip is above the
            base.
        """
        base, tip = _plain(base), _plain(tip)
        for link, option in ((base, 'base'), (tip, 'tip')):
            if link not in self.links:
                hint = did_you_mean(meant_by(link, tuple(self.links)))
                names = listed_names(self.links)
                self.root.refuse(f'no link {quoted(link)} for the {option}{hint} (links: {names})')
        joints = self._joints_above(tip, base)
        links = [tip, *(end_of(joint, 'parent') for joint in joints)]
        if links[-1] == base:
            return UrdfWay((), tuple(reversed(joints)))
        up = self._joints_above(base, *links)
        meets = end_of(up[-1], 'parent') if up else base
        if meets not in links[1:]:
            above = f'; it is below: {listed_names(links[1:])}' if links[1:] else ''
            self.root.refuse(f'{quoted(tip)} is not below {quoted(base)}{above}')
        return UrdfWay(up, tuple(reversed(joints[: links.index(meets)])))

    def _joints_above(self, link: str, *ends: str) -> tuple[XmlElement, ...]:
        # Upwards from a link, as far as one of the ends or the root.
        joints: list[XmlElement] = []
        while link not in ends and (above := self.above.get(link, ())):
            if len(above) > 1:
                names = ' and '.join(quoted(joint.attributes['name']) for joint in above)
                above[1].refuse(
                    f'a loop: link {quoted(link)} is the child of {names}; '
                    'a robot file takes chains'
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
        The joint does not name it.
    """
    element = joint.first(end)
    link = None if element is None else element.attributes.get('link')
    if not link:
        joint.refuse(f'it has no <{end} link="..."/>')
    return _plain(link)


def _plain(link: str) -> str:
    return link.removeprefix('/')


def read_tree(root: XmlElement) -> UrdfTree:
    """
    Return the links and joints of a file.

    Raises
    ------
    UrdfError
        One has no name, has the name of another, or refers to a link that does not exist; a link
        is below itself.
    """
    links, joints = _named(root, 'link', _plain), _named(root, 'joint', str)
    if not links:
        raise UrdfError(f'{root.file}: there is no <link> in it')
    above: dict[str, list[XmlElement]] = {}
    for joint in joints.values():
        for end in ('parent', 'child'):
            if end_of(joint, end) not in links:
                names = listed_names(links)
                joint.refuse(f'its {end} {quoted(end_of(joint, end))} is no link (links: {names})')
        above.setdefault(end_of(joint, 'child'), []).append(joint)
    tree = UrdfTree(root, links, joints, above)
    _refuse_circle(tree)
    return tree


def _refuse_circle(tree: UrdfTree) -> None:
    # Links are taken off from above; those of a circle, and what is below it, are left.
    above = {
        link: [end_of(joint, 'parent') for joint in tree.above.get(link, ())]
        for link in tree.links
    }
    sorter = TopologicalSorter(above)
    with suppress(CycleError):
        sorter.prepare()
    while free := sorter.get_ready():
        sorter.done(*free)
        for link in free:
            del above[link]
    if not above:
        return
    way = [next(iter(above))]
    while way[-1] not in way[:-1]:
        # The last joint of the file closes it.
        joint = next(
            one for one in reversed(tree.above[way[-1]]) if end_of(one, 'parent') in above
        )
        way.append(end_of(joint, 'parent'))
    circle = way[way.index(way[-1]) :]
    joint.refuse(f'a loop: link {quoted(circle[0])} is below itself ({listed_names(circle)})')


def _named(root: XmlElement, tag: str, plain: Callable[[str], str]) -> dict[str, XmlElement]:
    found: dict[str, XmlElement] = {}
    for element in root.all(tag):
        name = plain(element.attributes.get('name', ''))
        if not name:
            element.refuse('it has no name')
        if name in found:
            element.refuse(f'line {found[name].line} has the same name')
        found[name] = element
    return found
