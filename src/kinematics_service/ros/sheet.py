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


class _Copied(NamedTuple):
    # A message whose numbers can be copied: where it begins (bytes), and where they come from.
    template: Template
    begin: int
    sources: Integers
    of_motion: bool


def sheet_of(
    topics: Sequence[tuple[Topic, Template | None]], settings: Settings, depth: int
) -> Sheet:
    """
    Return the sheet of topics for answers of some depth.

    """
    copied: list[_Copied | None] = []
    size = 0
    for topic, template in topics:
        one = None if template is None else _copied(topic, template, size, settings, depth)
        copied.append(one)
        if one is not None:
            size = one.begin + len(one.template.data)
    return _filled(copied, size)


def _copied(
    topic: Topic, template: Template, size: int, settings: Settings, depth: int
) -> _Copied | None:
    sources = sources_of(topic, settings, depth, moving=True)
    begin = size + -(size + template.place) % 8  # so that the numbers are aligned
    stamp_place = template.stamp_place or 0
    if sources is None or (begin + stamp_place) % 4 != 0:
        return None
    of_motion = sources_of(topic, settings, depth, moving=False) is None
    return _Copied(template, begin, sources, of_motion)


def _filled(copied: Sequence[_Copied | None], size: int) -> Sheet:
    # The places, then `size` bytes of messages.
    there = [one for one in copied if one is not None]
    if not there:
        return Sheet((None,) * len(copied), np.empty(0))
    sources = np.concatenate([one.sources for one in there])
    stamped = [one for one in there if one.template.stamped]
    before = 2 + len(stamped) + 2 * sources.size
    stamps = [before * 2 + (one.begin + (one.template.stamp_place or 0)) // 4 for one in stamped]
    targets = [
        before + (one.begin + one.template.place) // 8 + k
        for one in there
        for k in range(one.sources.size)
    ]
    numbers = np.zeros(before + -(-size // 8))
    numbers.view(np.int64)[:before] = [len(stamps), sources.size, *stamps, *sources, *targets]
    messages = numbers[before:].view(np.uint8)
    parts: list[Part | None] = []
    for one in copied:
        if one is None:
            parts.append(None)
            continue
        data = messages[one.begin : one.begin + len(one.template.data)]
        data[:] = np.frombuffer(one.template.data, np.uint8)
        parts.append(Part(data.data, one.of_motion))
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
