# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Find the columns of an arm in a table, by known column names or by `--columns`."""

import re
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from ....errors import RecordingError
from ....typography import listed
from ...checking.pose_format import (
    ACCEPTED_POSES,
    MAKERS,
    PoseFormat,
    pose_columns,
    pose_of_columns,
)
from .head_units import units_of_heads
from .joint_format import ANGLES, LENGTHS, PERCENT, STATE, JointFormat
from .source import Selection
from .stamp_format import UNITS, StampFormat

# Largest number of columns listed in an error message.
MAX_LISTED = 12
# Largest number of characters of a column name in an error message. A longer name is cut.
MAX_NAME_LENGTH = 60
STAMP = 'stamp'
# Known names of the stamp column, in small letters. If a layout of tables has no name for its
# stamp column, a column with one of these names is used.
STAMPS = (STAMP, 'timestamp', 'time', 't', 'date', 'datetime', '%time', '__time')
# Matches a range of column numbers, counted from 1, such as 2-7.
NUMBERS = re.compile(r'(\d+)(?:-(\d+))?')
# Matches the name of a joint's position column that ends in a number, such as q1 or joint_3. In a
# table with such names, the names of the velocity columns start with one of RATES.
NUMBERED = re.compile(r'((?:q|j|joint|axis|theta|angle|pos|position)[ _.]?)\d+', re.IGNORECASE)
RATES = ('qd', 'dq', 'qdot', 'qd_', 'dq_', 'velocity', 'velocity_', 'vel_')
# Matches words for commanded values. If the name of a pose column has such a word, the column is
# skipped, because only measured poses are read.
COMMAND_WORDS = re.compile('target|goal|command|cmd|desired|ref|set', re.IGNORECASE)
SLICE = re.compile(r'(.+)\[(\d*):(\d*)\]')
HOW = (
    '--columns stamp=...,position=...,velocity=...,pose=... says how column names begin; without '
    'stamps, --stamps 30Hz numbers the rows, and --stamps none says that the arm stands in each'
)


class ColumnNames(NamedTuple):
    """
    How columns are called: the prefixes of the names of position, velocity and pose columns, and
    the whole name of the stamp column.

    If `position` is empty, each position column has only the joint's name, and velocities are not
    read.
    """

    stamp: str
    position: str
    velocity: str
    pose: str


class Layout(NamedTuple):
    """
    A known layout of tables: the names of the columns, and the units of the numbers.

    Attributes
    ----------
    maker
        Maker of the robot controller, one of `MAKERS`: the numbers have the units of this maker.
        If `maker` is empty, the units are rad and m.
    needed
        Names of further columns, in small letters, that the table must have.
    numbered
        Whether column names identify joints only by a number, such as q1, not by the joint's name.
    """

    names: ColumnNames
    maker: str = ''
    needed: tuple[str, ...] = ()
    numbered: bool = False


LAYOUTS = (
    Layout(ColumnNames(STAMP, 'position.', 'velocity.', 'pose.')),
    # The layout of files recorded by Universal Robots' RTDE client.
    Layout(ColumnNames('timestamp', 'actual_q_', 'actual_qd_', 'actual_TCP_pose_')),
    # A layout whose joint columns have the names of the joints, with a pose as x, y, z and
    # orientation.
    Layout(ColumnNames('', '', '', '')),
    # Layouts with the names and units of controller makers: AXIS_ACT and POS_ACT (KUKA),
    # jointtarget and robtarget (ABB), and displays of teach pendants.
    Layout(ColumnNames('', 'A', '', ''), 'kuka', ('x', 'y', 'z', 'a', 'b', 'c')),
    Layout(ColumnNames('', 'J', '', ''), 'fanuc', ('x', 'y', 'z', 'w', 'p', 'r')),
    Layout(ColumnNames('', 'rax_', '', ''), 'abb'),
    Layout(ColumnNames('', 'JT', '', ''), 'kawasaki', ('x', 'y', 'z', 'o', 'a', 't')),
)


class ArmColumns(NamedTuple):
    """
    Which columns of a table belong to an arm, and the units and formats of their numbers.

    Attributes
    ----------
    stamp
        Name of the column of stamps. Empty if stamps are computed from row numbers.
    stamps
        The unit of the stamps; or, if the table has no stamps, the rate of its rows.
    positions, velocities, poses
        Column names. Positions and velocities are in the order of the arm's joints; velocities may
        be empty. `poses` are the columns of one tool pose: position, then orientation.
    joints, form
        Units of the joint columns, and format of the pose columns.
    names
        How the columns are called in this layout, for error messages.
    guessed
        Assumptions about units and joints that were made from the column names, each a sentence.
    """

    stamp: str
    stamps: StampFormat
    positions: list[str]
    velocities: list[str]
    poses: list[str]
    joints: JointFormat
    form: PoseFormat
    names: ColumnNames
    guessed: tuple[str, ...]


def arm_columns(
    file: Path | str, header: list[str], selection: Selection, accepted: str = HOW
) -> ArmColumns:
    """
    Find the columns of an arm in the header of a table.

    Parameters
    ----------
    file
        Path of the table, for error messages.
    accepted
        Text that describes the accepted columns, for the error about a missing column.

    Raises
    ------
    RecordingError
        A column is missing or occurs twice, or `--columns` is not valid.
    """
    name, times = Counter(header).most_common(1)[0]
    if times > 1:
        message = f'{file}: column {_cut(name)} occurs twice; rename one of them'
        raise RecordingError(message, code='duplicate-name')
    return _Search(file, header, selection, accepted).columns()


class _Search:
    def __init__(
        self, file: Path | str, header: list[str], selection: Selection, accepted: str
    ) -> None:
        names = selection.robot.joint_names
        self.heads = units_of_heads(header, names)
        self.file, self.header, self.selection = file, self.heads.names, selection
        self._accepted = accepted
        self.joints = [selection.joint_prefix + name for name in names]
        named = {head: name for name, head in self.heads.heads.items()}
        given = {} if selection.columns is None else _given(selection.columns)
        self._given = {key: named.get(value, value) for key, value in given.items()}

    def columns(self) -> ArmColumns:
        layout = self._layout()
        names, selection = layout.names, self.selection
        guessed: list[str] = []
        stamp = self._stamp(names.stamp)
        positions, velocities = self._positions(names.position), self._family(names.velocity)
        if len(positions) != len(self.joints):
            raise RecordingError(
                f'{self.file}: --columns: position= names {len(positions)} columns; give '
                f'{len(self.joints)}, one for each joint of {selection.robot.name}',
                code='wrong-length',
            )
        joints, form = self._joint_units(positions), selection.pose_format
        for scale, column in zip(joints.units(selection.robot).scale, velocities):
            unit = self.heads.units.get(column, '')
            if unit and (ANGLES | LENGTHS).get(unit.removesuffix('/s')) != scale:
                head = self.heads.heads[column]
                raise RecordingError(
                    f'{self.file}: column {head!r} is in {unit}, but the position of its joint is '
                    'in another unit; write both in one unit',
                    code='mixed-units',
                )
        if layout.maker:
            if joints == JointFormat():
                joints = JointFormat('deg,mm')
                guessed.append(
                    f'joints {names.position}1, {names.position}2, ... are taken in degrees, as '
                    f'{layout.maker.upper()} writes them (--joint-format says other units)'
                )
            if form == PoseFormat():
                form = MAKERS[layout.maker]
        state = [name for name in self.header if name.startswith(f'{STATE}.')]
        if positions[0] in state:
            joints = joints._replace(first=state.index(positions[0]))
        if layout.numbered:
            text = f'{listed(positions, MAX_LISTED)} are taken for {", ".join(self.joints)}'
            if joints == JointFormat():
                raise RecordingError(
                    f'{self.file}: {text}, by their numbers, but their unit is not given; add '
                    '--joint-format rad, or --joint-format deg,mm',
                    code='missing-unit',
                )
            guessed.append(f'{text}, by their numbers')
        if not names.position and joints == JointFormat():
            guessed.append(
                f'{listed(positions, MAX_LISTED)} are taken in rad and m (--joint-format says '
                'other units)'
            )
        poses, form = self._poses(names.pose, form)
        requested = {'position', 'pose'} & self._given.keys()
        if not (poses or requested) and form == PoseFormat():
            poses, form = self._poses_alone(guessed)
        if set(poses) & set(positions):
            poses, form = [], PoseFormat()  # x, y and z are joints of a gantry, not a pose
        if layout.maker and poses:
            guessed.append(
                f'poses {", ".join(poses)} are taken as {layout.maker.upper()} writes them: '
                f'{form.in_words()} (--pose-format says what else they are)'
            )
        form, stamps = self._pose_units(poses, form), self._stamp_unit(stamp)
        heads = self.heads.heads
        stamp, named = heads.get(stamp, ''), (positions, velocities, poses)
        positions, velocities, poses = ([heads[name] for name in some] for some in named)
        return ArmColumns(
            stamp, stamps, positions, velocities, poses, joints, form, names, tuple(guessed)
        )

    def _joint_units(self, positions: list[str]) -> JointFormat:
        # Returns the units of the joint columns, from the options and the column names. Raises an
        # error if they contradict each other.
        robot, given, units = self.selection.robot, self.selection.joint_format, {}
        for name, column, slides in zip(robot.joint_names, positions, robot.prismatic):
            accepted = (*(LENGTHS if slides else ANGLES), PERCENT)
            if not given.text or self.heads.units.get(column) in accepted:
                units[name] = self.heads.unit([column], accepted, str(self.file))
        words = ','.join(f'{name}={unit}' for name, unit in units.items() if unit)
        if not words:
            return given
        if given.text:
            option, header = (JointFormat(text) for text in (given.text, f'{given.text},{words}'))
            if (option.units(robot).scale != header.units(robot).scale).any():
                raise self._contradiction(words, f'--joint-format {given.text}')
            return given
        if '' in units.values():
            raise RecordingError(
                f'{self.file}: some joint columns have a unit in the header ({words}) and some do '
                'not; give all units with --joint-format',
                code='mixed-units',
            )
        return JointFormat(words)

    def _pose_units(self, poses: list[str], form: PoseFormat) -> PoseFormat:
        units = {
            'length': self.heads.unit(poses[:3], LENGTHS, str(self.file)),
            'angle': self.heads.unit(poses[3:], ('rad', 'deg'), str(self.file)),
        }
        for field, unit in units.items():
            given = getattr(self.selection.pose_format, field)
            if unit and given not in (unit, getattr(PoseFormat(), field)):
                raise self._contradiction(unit, f'--pose-format {given}')
        return form._replace(**{field: unit for field, unit in units.items() if unit})

    def _stamp_unit(self, stamp: str) -> StampFormat:
        unit, given = self.heads.unit([stamp], UNITS, str(self.file)), self.selection.stamps
        if unit and given.unit not in ('', unit):
            raise self._contradiction(unit, f'--stamps {given.unit}')
        return given._replace(unit=unit or given.unit)

    def _contradiction(self, units: str, option: str) -> RecordingError:
        return RecordingError(
            f'{self.file}: {option}: the header says {units}; leave out one of them',
            code='conflict',
        )

    def _layout(self) -> Layout:
        usual = LAYOUTS[0]
        if 'position' in self._given:
            names = usual.names._replace(**self._given)
            self._required(names.position)
            return Layout(names)
        for layout in (*LAYOUTS, *self._numbered_joints()):
            if self._fits(layout):
                return layout._replace(names=layout.names._replace(**self._given))
        self._required(usual.names.position)
        return usual

    def _numbered_joints(self) -> list[Layout]:
        # Returns a layout if the joint columns have names such as q1 ... q6 or J 1 ... J 6. There
        # must be as many such columns as joints of the arm, and numbers in the joints' own names
        # must rise in the order of the arm.
        starts = [part[1] for name in self.header if (part := NUMBERED.fullmatch(name))]
        numbers = [int(part[1]) for name in self.joints if (part := re.search(r'(\d+)$', name))]
        if len(set(starts)) != 1 or len(starts) != len(self.joints) or numbers != sorted(numbers):
            return []
        # Return no layout if the numbers could mean something else. Columns q1 .. q4 may be a
        # quaternion. If a column has the name of a joint, such as q1, the number may be part of
        # the name: column q1 is then joint q1, and not the second joint, counted from q0.
        if pose_columns(self.header, [''], PoseFormat('wxyz')) or {*self.joints} & {*self.header}:
            return []
        rates = next((rate for rate in RATES if self._family(rate)), '')
        return [Layout(ColumnNames('', starts[0], rates, ''), numbered=True)]

    def _fits(self, layout: Layout) -> bool:
        names = layout.names
        if not self._positions(names.position):
            return False
        if layout.maker:
            ends = {name.lower() for name in self.header}
            return ends >= set(layout.needed)
        # Position columns may be named by joint (`elbow`), by number (`q1`), or by a prefix and
        # the joint (`position.elbow`). With such a prefix, the layout fits only if its stamp
        # column exists, or if an option gives the stamps. Without a prefix, the layout fits even
        # if the stamps are missing; an error about missing stamps follows later.
        named = names.position and not layout.numbered and 'stamp' not in self._given
        return not named or names.stamp in self.header or self.selection.stamps.rate > 0.0

    def _stamp(self, name: str) -> str:
        if self.selection.stamps.rate:
            return ''
        named = {column.lower(): column for column in self.header}
        if not name or (name == STAMP and name not in named):
            name = next((named[stamp] for stamp in STAMPS if stamp in named), STAMP)
        columns = self._numbered(name)
        if columns:
            return columns[0]
        if name not in self.header:
            unit = '' if 'stamp' in self._given else ' (seconds)'
            hint = '' if 'stamp' in self._given else f'; {self._accepted}'
            raise RecordingError(
                f'{self.file}: there is no column {name!r}{unit}; the header has '
                f'{self._shown()}{hint}',
                code='missing-column',
            )
        return name

    def _required(self, beginning: str) -> None:
        if not self._positions(beginning):
            missing = [j for j in self.joints if beginning + j not in self.header]
            alone = (
                '; the table has poses of the tool: kinematics_service ik --one computes joint '
                'positions from a pose'
            )
            raise RecordingError(
                f'{self.file}: there is no column {beginning + missing[0]!r} for joint '
                f'{missing[0]!r} of {self.selection.robot.name}; the header has {self._shown()}; '
                f'{self._accepted}{alone if self._poses_alone([])[0] else ""}',
                code='missing-column',
            )

    def _positions(self, beginning: str) -> list[str]:
        # Returns the columns of the joint positions, whose names start with `beginning`. If
        # `beginning` is empty, these columns have the names of the joints.
        if beginning:
            return self._family(beginning)
        both = self.joints, self.selection.robot.joint_names
        return next((list(names) for names in both if set(names) <= set(self.header)), [])

    def _family(self, beginning: str) -> list[str]:
        # Returns the column of each joint: its name is `beginning` followed by the joint's name or
        # number (from 0 or 1). Returns [] if the column of a joint is missing.
        if not beginning:
            return []
        columns = self._numbered(beginning)
        if columns:
            return columns
        n = len(self.joints)
        for start in (beginning, f'{beginning}.', f'{beginning}_', f'{beginning} '):
            for ends in (self.joints, self.selection.robot.joint_names, range(n), range(1, n + 1)):
                columns = [f'{start}{end}' for end in ends]
                if all(column in self.header for column in columns):
                    # If the table has columns 0 to n, the n joints could be columns 0 to n - 1 or
                    # columns 1 to n. Columns 0 to n - 1 are tried first, so they are returned.
                    return columns
        return []

    def _numbered(self, text: str) -> list[str]:
        # Returns the columns that a text of `--columns` selects: a range of column numbers such as
        # 2-7, or a slice of a vector such as state[0:6]. Returns [] for other text.
        part = SLICE.fullmatch(text)
        if part is not None:
            elements = [name for name in self.header if name.startswith(f'{part[1]}.')]
            return elements[int(part[2] or 0) : int(part[3]) if part[3] else None]
        span = NUMBERS.fullmatch(text)
        if span is None:
            return []
        first, last = int(span[1]), int(span[2] or span[1])
        if not 1 <= first <= last <= len(self.header):
            raise RecordingError(
                f'{self.file}: --columns: {text} is outside the table; give numbers from 1 to '
                f'{len(self.header)}',
                code='out-of-range',
            )
        return self.header[first - 1 : last]

    def _poses(self, text: str, form: PoseFormat) -> tuple[list[str], PoseFormat]:
        requested = 'pose' in self._given or self.selection.pose_format != PoseFormat()
        parts = [part.strip() for part in text.split('+')]
        columns = [column for part in parts for column in self._numbered(part)]
        pose = (
            pose_of_columns(columns, form) if columns else pose_columns(self.header, parts, form)
        )
        if pose is None and requested:
            message = f'{self.file}: the columns {text}* are not a pose; {ACCEPTED_POSES}'
            raise RecordingError(message, code='missing-column')
        return pose or ([], PoseFormat())

    def _poses_alone(self, guessed: list[str]) -> tuple[list[str], PoseFormat]:
        # Returns the columns of the tool pose, whatever their names, if the table has exactly one
        # measured pose.
        named = (name for name in self.header if not COMMAND_WORDS.search(name))
        starts = dict.fromkeys(name[:-1] for name in named if name[-1:] in 'xX')
        tried = {start: pose_columns(self.header, [start], PoseFormat()) for start in starts}
        poses = {start: pose for start, pose in tried.items() if pose}
        if len(poses) > 1:
            words = ' or '.join(f'pose={start.strip()}' for start in poses)
            guessed.append(f'several poses are in the table, and none is read: --columns {words}')
        if len(poses) != 1:
            return [], PoseFormat()
        ((columns, form),) = poses.values()
        guessed.append(f'{", ".join(columns)} are taken for poses of the tool ({form.kind})')
        return columns, form

    def _shown(self) -> str:
        return listed([_cut(name) for name in self.heads.heads.values()], MAX_LISTED)


def _given(text: str) -> dict[str, str]:
    given = {}
    for item in text.split(','):
        key, equals, value = (part.strip() for part in item.partition('='))
        if not equals or key not in ColumnNames._fields:
            raise RecordingError(
                f'--columns: {item!r} is not accepted; write for instance '
                'stamp=time,position=q_,velocity=qd_,pose=tcp_',
                code='unknown-key' if equals else 'syntax',
            )
        given[key] = value.rstrip('*')
    return given


def _cut(name: str) -> str:
    return ascii(name if len(name) <= MAX_NAME_LENGTH else f'{name[:MAX_NAME_LENGTH]}...')
