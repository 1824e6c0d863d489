"""
The demo's live table: everything in it was heard on the node's topics.

"""

import math
import os
import textwrap
from collections.abc import Sequence

from rich.console import Group
from rich.text import Text

from ..kernel import Floats
from ..measures import Level
from ..printing import plain
from .listener import INTERVAL, MEASURES, Listener
from .live_table import STYLES, bars, coloured, matrix_lines, number
from .readings import LayoutError, Warned, matrix_of, pose_of, velocity_of

# A sentence has so many lines, so that nothing below it jumps.
SENTENCE_LINES = 2
LABEL = 18
LEFT_COLUMN = 22
NARROW = 8
# A bar of full height is this distance, in rad.
FULL = 0.5
NOTHING = '-'


def screen(listener: Listener, width: int, blocks: bool) -> Group:
    """
    Return the live table: at most 24 lines of 80 characters for up to seven joints.

    Parameters
    ----------
    listener
        What was heard.
    width
        Characters in a line.
    blocks
        Whether the terminal can show block characters.

    """
    lines = [
        _title(listener, width),
        *_warning(listener.warned, width),
        Text(),
        *_motion(listener),
        Text(),
        *_jacobian(listener, width),
        Text(),
        *_measures(listener),
    ]
    if blocks:
        shown = list(listener.history)[-(width - LABEL) :]
        label = f'distance, {len(shown) * INTERVAL:.0f} s'
        lines.append(_labelled(label, bars(shown, FULL)))
    lines.append(
        Text(f'elsewhere: python -m kinematics_service echo jacobian --node {listener.source}')
    )
    for line in lines:
        line.no_wrap, line.overflow = True, 'ellipsis'
    return Group(*lines)


def _labelled(label: str, rest: str, style: str = '') -> Text:
    return Text.assemble((label.ljust(LABEL), 'bold'), (rest, style))


def _title(listener: Listener, width: int) -> Text:
    robot = listener.warned.values.get('robot', '') if listener.warned else ''
    left = f'{plain(robot)}  {listener.source}'
    right = f'{listener.time:.1f} s  {listener.jacobian.rate():.0f} Hz  Ctrl-C ends it'
    return Text(left + right.rjust(width - len(left)), style='bold')


def _warning(warned: Warned | None, width: int) -> list[Text]:
    if warned is None:
        return [Text('waiting for the node'), *[Text()] * (SENTENCE_LINES - 1)]
    sentence = plain(warned.sentence)
    if warned.level != Level.STALE.name:
        # The numbers in it are those of the moment it was said; those of now stand below.
        head, _, tail = sentence.partition(': ')
        factor = plain(warned.values.get('factor', ''))
        if factor and tail.startswith(factor):
            head += f' ({factor})'
        sentence = '; '.join(part for part in (head, tail.partition('; ')[2]) if part)
    indent = ' ' * 7
    lines = textwrap.wrap(
        warned.level.ljust(len(indent)) + sentence,
        width,
        subsequent_indent=indent,
        max_lines=SENTENCE_LINES,
        placeholder=' ...',
    )
    texts = [coloured(line, warned.level) for line in lines]
    return texts + [Text()] * (SENTENCE_LINES - len(texts))


def _motion(listener: Listener) -> list[Text]:
    pose = twist = NOTHING
    if listener.pose.message is not None:
        heard = pose_of(listener.pose.message)
        degrees = [math.degrees(angle) for angle in heard.roll_pitch_yaw]
        pose = f'{_narrow(heard.position)} m    rpy {_narrow(degrees, 1)} deg'
    if listener.twist.message is not None:
        velocity = velocity_of(listener.twist.message)
        twist = f'{_narrow(velocity.linear)} m/s  ang {_narrow(velocity.angular)} rad/s'
    return [
        Text.assemble(('tool  x y z ', 'bold'), pose),
        Text.assemble(('twist x y z ', 'bold'), twist),
    ]


def _narrow(values: Sequence[float] | Floats, decimals: int = 4) -> str:
    return ''.join(f' {number(float(value), decimals).rjust(NARROW - 1)}' for value in values)


def _jacobian(listener: Listener, width: int) -> list[Text]:
    if listener.jacobian.message is None:
        return [_labelled('Jacobian', NOTHING)]
    try:
        lines = matrix_lines(matrix_of(listener.jacobian.message), width)
    except LayoutError as error:
        return [_labelled('Jacobian', str(error))]
    return [Text(line) for line in lines]


def _measures(listener: Listener) -> list[Text]:
    value = {name: listener.measure(name) for name in MEASURES}
    distance = listener.measure('distance')
    warned = listener.warned
    level = warned.level if warned else ''
    near = {}
    if warned is not None and level in (Level.WARN.name, Level.ERROR.name):
        near = warned.values
    always = []
    if warned is not None and 'structural' in warned.values:
        always = [_labelled('always', plain(warned.values['structural']))]
    shown = NOTHING
    if distance is not None:
        shown = f'{distance:.4f} rad = {math.degrees(distance):.1f} deg'
    pairs = (
        ('det(J)', 'determinant', 'manipulability', 'manipulability'),
        ('condition number', 'condition_number', 'smallest sigma', 'smallest_singular_value'),
    )
    return [
        _labelled('distance', shown, STYLES.get(level, '')),
        *(
            _labelled(left, _measure(value[first]).ljust(LEFT_COLUMN)).append_text(
                _labelled(right, _measure(value[second]))
            )
            for left, first, right, second in pairs
        ),
        *always,
        _labelled('lost direction', plain(near.get('lost_direction', NOTHING))),
        _labelled('joints opposed', _shortened(near.get('joints_against_each_other', NOTHING))),
    ]


def _measure(value: float | None) -> str:
    return 'none' if value is None else f'{value:+.4g}' if value < 0.0 else f' {value:.4g}'


def _shortened(joints: str) -> str:
    # "a_joint + b_joint" is easier to read without what all names end in.
    names = [word for word in plain(joints).split(' ') if word not in '+-']
    common = os.path.commonprefix([name[::-1] for name in names])[::-1]
    ending = common[common.find('_') :] if '_' in common and len(names) > 1 else ''
    return plain(joints).replace(ending, '') if ending else plain(joints)
