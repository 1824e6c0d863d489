# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Replace sections of a robot file; the rest of its text stays unchanged.

The YAML is parsed only to find the lines of its sections. The caller must read the result again to
check it.
"""

from collections.abc import Mapping, Sequence

import yaml
from yaml import MappingNode

from ...errors import RobotFileWriteError
from ...robot.file.parts import description
from ...robot.file.text.yaml_reader import LOADER
from ...robot.file.writing.writer import BOM, entry_of, last_line, scalar, written_entries


def with_sections(
    text: str, sections: Mapping[str, Sequence[str] | None], header: Sequence[str] = ()
) -> str:
    """
    Return the text of a robot file with some of its sections replaced.

    Parameters
    ----------
    text
        A valid robot file.
    sections
        New lines of each section by its key; the first line has the key. None removes a section.
        Sections that the file does not have come last.
    header
        Comment lines that begin the file.

    Raises
    ------
    RobotFileWriteError
        The whole file is one mapping in braces.
    """
    text = text.removeprefix(BOM)
    root = yaml.compose(text, Loader=LOADER)
    assert isinstance(root, MappingNode)  # each valid robot file is a mapping
    if root.flow_style:
        message = 'the keys of the robot file are in braces; write them as lines'
        raise RobotFileWriteError(message, code='unsupported')
    lines = text.splitlines()
    spans = {key.value: (key.start_mark.line, last_line(value)) for key, value in root.value}
    # Replace the last section first, so that the lines before it keep their numbers.
    for key in sorted(sections.keys() & spans.keys(), key=spans.__getitem__, reverse=True):
        first, last = spans[key]
        lines[first : last + 1] = sections[key] or ()
    for key, section in sections.items():
        if key not in spans:
            lines += section or ()
    return '\n'.join([*header, *lines, ''])


def singularity_section(
    text: str, factors: Sequence[description.Factor], task: Sequence[str] = ()
) -> list[str] | None:
    """
    Return the lines of the section `singularity` of a robot file, with its singular factors
    replaced by `factors`; None if the section is then empty.

    The rows of `task` are added if the section has no task.
    """
    lines = _entries(text, 'singularity', ('factors',))
    if task and not any(line.startswith('  task:') for line in lines):
        lines.insert(0, f'  task: [{", ".join(task)}]')
    if factors:
        lines.append('  factors:')
    for factor in factors:
        approximate = ', approximate: true' if factor.approximate else ''
        entry = f'name: {scalar(factor.name)}, expression: {scalar(factor.text)}{approximate}'
        lines.append(f'    - {{{entry}}}')
    return ['singularity:', *lines] if lines else None


def constants_section(text: str, without: Sequence[str]) -> list[str] | None:
    """
    Return the lines of the section `constants` without the named constants; None if no constant is
    left.
    """
    lines = _entries(text, 'constants', without)
    return ['constants:', *lines] if lines else None


def _entries(text: str, section: str, without: Sequence[str]) -> list[str]:
    # Return the entries of a section of a robot file, one line for each, without the keys in
    # `without`.
    plain = text.removeprefix(BOM)
    root = yaml.compose(plain, Loader=LOADER)
    assert isinstance(root, MappingNode)
    pair = entry_of(root, section)
    written = {} if pair is None else written_entries(plain, pair[1], without)
    return [f'  {entry}' for entry in written.values()]


def links_section(links: Sequence[description.Link]) -> list[str]:
    """Return the lines of the section `links`, one line for each row of the table."""
    return ['links:', *(f'  - {_link(link)}' for link in links)]


def placement_section(key: str, placement: description.Placement, note: str = '') -> list[str]:
    """
    Return the section `base` or `tool` of a robot file, a list with one line. The comment at the
    end of the line is `note`.
    """
    pose = _motion(placement.motion).removeprefix('{')
    comment = f'  # {note}' if note else ''
    return [f'{key}: {{frame: {scalar(placement.frame)}, {pose}{comment}']


def points_section(points: Sequence[description.PointDescription]) -> list[str]:
    """Return the lines of the section `points`."""
    lines = ['points:']
    for point in points:
        pose = _motion(point.motion).removeprefix('{')
        lines.append(f'  {scalar(point.name)}: {{row: {point.row}, {pose}')
    return lines


def _link(link: description.Link) -> str:
    if isinstance(link, description.DhRow):
        cells = (f'{name}: {scalar(link[name].text)}' for name in link.names)
        return f'{{{", ".join(cells)}}}'
    if isinstance(link, description.ElementaryMotion):
        return _elementary(link)
    parts = []
    if link.inner != description.IDENTITY or (
        link.joint is None and link.outer == description.IDENTITY
    ):
        parts.append(f'in: {_motion(link.inner)}')
    if link.joint is not None:
        parts.append(f'joint: {_elementary(link.joint)}')
    if link.outer != description.IDENTITY:
        parts.append(f'out: {_motion(link.outer)}')
    return f'{{{", ".join(parts)}}}'


def _elementary(motion: description.ElementaryMotion) -> str:
    return scalar(f'{motion.axis}({motion.argument.text})')


def _motion(motion: description.RigidMotion) -> str:
    texts = [scalar(text) for text in motion.texts]
    if len(texts) == 6:
        return f'{{xyz: [{", ".join(texts[:3])}], rpy: [{", ".join(texts[3:])}]}}'
    rows = (f'[{", ".join(texts[k : k + 4])}]' for k in range(0, 16, 4))
    return f'[{", ".join(rows)}]'
