"""
From blocks of messages to a timeline: the kernel in batches, the judging message by message.

"""

import dataclasses
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..errors import JointVectorError
from ..estimator import ACCEPTED, TOO_LARGE
from ..kernel import Floats
from ..measures import Level
from ..notice import Notice, notice_of, stale_notice
from ..robot import Robot
from ..singularities import FactorMeasures, Singularity, singularity_of
from ..tool_state import ToolState, evaluate
from .block import Block, Flags
from .ingest import Ingest, Known
from .judging import Judge, Levels
from .timeline import MEASURE_NAMES, Part, Said, Timeline

# Sentences kept; an arm that chatters at a threshold for hours is told by its first ones.
MOST_SAID = 10_000


def part_singularity(singularity: Singularity, k: int, moving: bool) -> Singularity:
    """
    Return the measures of one pose of a batch; `moving`: its velocities are known.

    """
    values: dict[str, Any] = {}
    for field in dataclasses.fields(Singularity):
        value = getattr(singularity, field.name)
        if isinstance(value, FactorMeasures):
            value = FactorMeasures(
                value.names, value.distances[k], value.results[k], value.column_scales[k]
            )
        elif isinstance(value, np.ndarray):
            value = value[k]
        values[field.name] = value
    for name in MEASURE_NAMES:
        values[name] = None if values[name] is None else float(values[name])
    values['level'] = Level(int(values['level']))
    if not moving:
        values['rate'] = values['time_to_warning'] = None
    return Singularity(**values)


class Computer:
    """
    Turns blocks of messages into a timeline, batch by batch.

    Parameters
    ----------
    robot, ingest
        The arm; where its messages go in.
    base_frame, joint_prefix
        As the node's parameters, for the words of a warning.

    """

    def __init__(self, robot: Robot, ingest: Ingest, base_frame: str, joint_prefix: str) -> None:
        self._robot, self._ingest = robot, ingest
        self._base_frame, self._joint_prefix = base_frame, joint_prefix
        self._judge = Judge(robot.thresholds)
        self._quaternion: Floats | None = None
        self._rows = 0
        self._said: list[Said] = []
        self._columns: list[dict[str, Floats]] = []

    def run(self, blocks: Iterable[Block], each: Callable[[Block, Part | None], None]) -> Timeline:
        """
        Return the timeline of all blocks; `each` is called with every one and what it made.

        """
        for block in blocks:
            known = self._ingest.take(block)
            part = self._part(known) if len(known) else None
            each(block, part)
        return self._timeline()

    def _part(self, known: Known) -> Part | None:
        robot = self._robot
        try:
            state = evaluate(robot, known.q, np.nan_to_num(known.qdot, nan=0.0))
        except JointVectorError:
            known = self._computable(known)
            if not len(known):
                return None
            state = evaluate(robot, known.q, np.nan_to_num(known.qdot, nan=0.0))
        singularity = singularity_of(state)
        factors = singularity.factors
        nearest = None if factors is None else np.argmin(factors.distances, axis=1)
        watched = getattr(singularity, robot.thresholds.measure)
        judged = self._judge.judge(
            np.abs(watched),
            singularity.lost_direction,
            nearest,
            known.arrivals,
            known.silences,
        )
        moving = ~np.any(np.isnan(known.qdot), axis=1)
        said = [
            Said(self._rows + k, silence.moment, self._stale_notice(silence.missing))
            for k, silence in judged.silences
        ]
        for k in judged.said:
            one = part_singularity(singularity, k, bool(moving[k]))
            level = Level(int(judged.levels[k]))
            notice = notice_of(robot, one, level, self._base_frame, self._joint_prefix)
            said.append(Said(self._rows + k, int(known.arrivals[k]), notice))
        said.sort(key=lambda one: (one.row, one.moment))
        quaternion = self._continuous(state.quaternion_xyzw, known.fresh)
        first = self._rows
        self._keep(known, state, quaternion, singularity, judged.levels, moving, said)
        return Part(first, known, state, quaternion, singularity, said)

    def _computable(self, known: Known) -> Known:
        # Lengths of the robot file can overflow with positions the estimator lets pass.
        good = np.ones(len(known), dtype=bool)
        for k in range(len(known)):
            try:
                evaluate(self._robot, known.q[k], np.nan_to_num(known.qdot[k], nan=0.0))
            except JointVectorError:
                good[k] = False
        lost = int(np.sum(~good))
        self._ingest.counts[ACCEPTED] -= lost
        self._ingest.counts[TOO_LARGE] += lost
        at = np.cumsum(good) - 1
        columns = {
            field.name: getattr(known, field.name)[good]
            for field in dataclasses.fields(Known)
            if field.name != 'silences'
        }
        kept = {int(at[k]): silence for k, silence in known.silences.items() if good[k]}
        return Known(**columns, silences=kept)

    def _stale_notice(self, missing: tuple[str, ...]) -> Notice:
        return stale_notice(self._robot, f'no joint state of {", ".join(missing)}')

    def _continuous(self, quaternions: Floats, fresh: Flags) -> Floats:
        # As the estimator: turned where the last one, as published, points the other way.
        before = quaternions[:1] if self._quaternion is None else self._quaternion[None]
        last = np.concatenate([before, quaternions[:-1]])
        dots = np.einsum('ij,ij->i', quaternions, last)
        for k in np.flatnonzero(np.abs(dots) < 1e-9):
            dots[k] = np.dot(quaternions[k], last[k])  # the sign of a sum depends on its order
        turns = np.where(dots < 0.0, -1.0, 1.0)
        signs = np.cumprod(turns)
        for k in np.flatnonzero(fresh | (dots == 0.0)):
            signs[k:] *= signs[k]  # here it begins anew, with w >= 0
        result: Floats = quaternions * signs[:, None]
        self._quaternion = np.array(result[-1])
        return result

    def _keep(
        self,
        known: Known,
        state: ToolState,
        quaternion: Floats,
        singularity: Singularity,
        levels: Levels,
        moving: Flags,
        said: list[Said],
    ) -> None:
        silent = np.zeros(len(known), dtype=bool)
        silent[list(known.silences)] = True
        factors = singularity.factors
        columns = {
            'messages': known.messages,
            'stamps': known.stamps,
            'arrivals': known.arrivals,
            'q': known.q,
            'qdot': known.qdot,
            'differenced': known.differenced,
            'position': np.array(state.position),
            'quaternion_xyzw': quaternion,
            'twist': np.where(moving[:, None], state.twist, np.nan),
            'time_to_warning': np.where(moving, singularity.time_to_warning, np.nan),
            'factors': np.zeros((len(known), 0))
            if factors is None
            else np.array(factors.distances),
            'levels': levels,
            'silent': silent,
        }
        for name in MEASURE_NAMES:
            values = getattr(singularity, name)
            if values is not None:
                columns[f'measure {name}'] = np.array(values)
        self._columns.append(columns)
        self._rows += len(known)
        self._said += said[: max(0, MOST_SAID - len(self._said))]

    def _timeline(self) -> Timeline:
        columns: dict[str, Any] = {}
        for name in list(self._columns[0]) if self._columns else ():
            columns[name] = np.concatenate([part.pop(name) for part in self._columns])
        if not columns:
            raise NoStateError
        measures = {
            name.partition(' ')[2]: columns.pop(name)
            for name in list(columns)
            if name.startswith('measure ')
        }
        steps = np.maximum(np.diff(columns['stamps'], prepend=columns['stamps'][:1]), 0)
        t = np.cumsum(steps) * 1e-9
        return Timeline(**columns, t=t, measures=measures, said=tuple(self._said))


class NoStateError(Exception):
    """
    No message made a state; why is for the caller to say.

    """
