"""
The messages of several topics in one buffer, whose numbers the kernel copies to their places.

Which number of a state goes where is not written here. A topic's numbers are asked for twice, of
states made of random numbers: where each of them is one of the state's numbers as it stands, and
the same one both times, it can be copied. Topics whose numbers are computed (a Jacobian in tool
axes) are not in a sheet, and neither are those that are built.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import kernel
from ..estimator import Answer
from ..kernel import Floats, Integers
from ..singularities import singularity_of
from ..tool_state import ToolState
from .messages import Report
from .settings import Settings
from .topics import Topic
from .wire_template import Template


class Part(NamedTuple):
    """
    One topic's message in a sheet.

    Attributes
    ----------
    data
        Its bytes.
    of_motion
        Whether there is such a message only where the velocities are known.

    """

    data: memoryview
    of_motion: bool


class Sheet(NamedTuple):
    """
    A buffer of messages.

    Attributes
    ----------
    parts
        The message of each topic, None for a topic that is not in the sheet.
    numbers
        The buffer, as `kernel.fill_sheet` takes it.

    """

    parts: tuple[Part | None, ...]
    numbers: Floats


def sheet_of(
    topics: Sequence[tuple[Topic, Template | None]], settings: Settings, depth: int
) -> Sheet:
    """
    Return the sheet of topics for answers of some depth.

    """
    size = 0  # of the messages, which stand after the places
    found: list[tuple[Template, int, Integers, bool] | None] = []
    for topic, template in topics:
        sources = None if template is None else sources_of(topic, settings, depth, True)
        if template is None or sources is None:
            found.append(None)
            continue
        at = -(size + template.place) % 8 + size  # so that the numbers are aligned
        if template.stamp_place is not None and (at + template.stamp_place) % 4 != 0:
            found.append(None)
            continue
        size = at + len(template.data)
        of_motion = sources_of(topic, settings, depth, False) is None
        found.append((template, at, sources, of_motion))
    there = [entry for entry in found if entry is not None]
    if not there:
        return Sheet(tuple(None for _ in topics), np.empty(0))
    count = sum(sources.size for _, _, sources, _ in there)
    before = 2 + sum(template.stamped for template, *_ in there) + 2 * count
    numbers = np.zeros(before + -(-size // 8))
    whole = numbers.view(np.uint8)
    parts: list[Part | None] = []
    stamps: list[int] = []
    sources_of_all: list[int] = []
    targets: list[int] = []
    for entry in found:
        if entry is None:
            parts.append(None)
            continue
        template, at, sources, of_motion = entry
        at += 8 * before
        data = whole[at : at + len(template.data)]
        data[:] = np.frombuffer(template.data, np.uint8)
        parts.append(Part(data.data, of_motion))
        if template.stamp_place is not None:
            stamps.append((at + template.stamp_place) // 4)
        first = (at + template.place) // 8
        sources_of_all.extend(sources.tolist())
        targets.extend(range(first, first + sources.size))
    places = [len(stamps), count, *stamps, *sources_of_all, *targets]
    numbers.view(np.int64)[:before] = places
    return Sheet(tuple(parts), numbers)


def sources_of(topic: Topic, settings: Settings, depth: int, moving: bool) -> Integers | None:
    """
    Return where in a state's row, or beyond its end in its measures, a topic's numbers stand.

    None where there are none, or where they are computed of them.

    """
    if topic.numbers is None:
        return None
    random = np.random.default_rng(23)
    robot = settings.robot
    sources = None
    for _ in range(2):
        row = random.normal(size=robot.chain.single_widths[depth])
        measures = random.normal(size=robot.measure_places.width)
        state = ToolState(robot, row, moving, None, measures)
        answer = Answer(state, row[-kernel.ROW_TAIL :], 0, 'message')
        numbers = topic.numbers(Report(answer, singularity_of(state), settings))
        if numbers is None:
            return None
        place_of = {number: k for k, number in enumerate([*row.tolist(), *measures.tolist()])}
        there = [place_of.get(number) for number in numbers.tolist()]
        if None in there or sources not in (None, there):
            return None
        sources = there
    return np.array(sources, dtype=np.int64)
