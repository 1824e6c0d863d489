# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an arm as one C++ or C header that computes with the same operations as the kernel.

Kernel functions without branches run once in Python, with objects that record each operation. The
header has the recorded operations for this arm, one after another. Kernel functions with branches,
such as the closing of loops, are translated to C.
"""

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ... import kernel
from ...errors import KinematicsError
from ...kernel import Chain, Floats
from ...kinematics.forward import forward_kinematics, jacobian
from ...robot.robot import Robot
from ...robot.task import generic_poses
from ...version import __version__
from .kernel_source import copied, replaced, source
from .recording import Recorder
from .translation import Text, Translation, listed, literal

SELF_TEST_POSES = 3
# A header in `float` states a bound of its errors: this factor times the largest error that occurs
# at 1000 test poses. The factor allows for larger errors at other poses, and for C libraries with
# less exact sines.
ERROR_MARGIN = 2.0
WIDTH = 99  # columns of a line in C


@cache
def parts() -> dict[str, str]:
    """Return the parts of the file `parts.h` by their names."""
    text = files(__package__).joinpath('parts.h').read_text(encoding='utf-8')
    pairs = (part.split('\n', 1) for part in text.split('\n//// ')[1:])
    return {name: content.rstrip('\n') for name, content in pairs}


def header_of(robot: Robot, cpp: bool, single: bool = False) -> str:
    """
    Return an arm as a header in C++, or else in C.

    Parameters
    ----------
    single
        Whether the numbers are `float` instead of `double`.

    Raises
    ------
    KinematicsError
        Names of points are not distinct in C, or an arm with closed loops is wanted in float.
    """
    if single and robot.chain.loops > 0:
        raise KinematicsError(
            f'{robot.name}: float does not resolve the residual of closed loops; leave out --float'
        )
    return Header(robot, cpp, 'float' if single else 'double').text()


class Header:
    """
    The header of an arm.

    Attributes
    ----------
    words
        Texts that replace the placeholders `@name@` in `parts.h`, by name. Two of the texts are
        beginnings of C names: `before` for names that users need, `prefix` for all other names.
    """

    def __init__(self, robot: Robot, cpp: bool, real: str) -> None:
        self.robot, self.real = robot, real
        name = f'kinematics_{robot.name}'
        before = '' if cpp else f'{name}_'
        self.translation = Translation(f'{before}detail_')
        factors = len(robot.singularity.factors.ends)
        counts = {'dof': robot.dof, 'frame_count': robot.chain.frames, 'factor_count': factors}
        form = 'constexpr int {} = {};' if cpp else f'enum {{{{ {before}{{}} = {{}} }}}};'
        self.words: dict[str, Any] = {
            'robot': robot.name,
            'language': 'C++17' if cpp else 'C99',
            'version': __version__,
            'source': _plain(robot.source),
            'units': ' and '.join(dict.fromkeys(robot.units)),
            'joints': _plain(', '.join(robot.joint_names)),
            'guard': f'{name.upper()}_{"HPP" if cpp else "H"}',
            'begin': f'namespace {name} {{' if cpp else '',
            'end': f'}}  // namespace {name}' if cpp else '',
            'before': before,
            'prefix': self.translation.prefix,
            'constant': 'constexpr' if cpp else 'static',
            'real': real,
            'dof': robot.dof,
            'columns': 6 * robot.dof,
            'counts': '\n'.join(form.format(*count) for count in counts.items()),
            'lower_limits': listed(robot.limits[:, 0], real),
            'upper_limits': listed(robot.limits[:, 1], real),
            'velocity_limits': listed(robot.velocity_limits, real),
            'joint_names': ', '.join(map(quoted, robot.joint_names)),
            'largest': literal(kernel.LARGEST_REDUCED),
            'poses': SELF_TEST_POSES,
        }
        self.closure = copied(robot.chain.closure) if robot.chain.loops else None
        chain_pass = source('forward.chain_pass')
        for function in (chain_pass.sincos, chain_pass._sincos_reduced):
            call = self.translation.call(function, [Text('angle[k]')])
            self.words[function.__name__.lstrip('_')] = call.text

    def text(self) -> str:
        """Return the text of the header."""
        self.words |= self._test_words()
        notes = (self.real, 'loops') if self.closure is not None else (self.real,)
        self.words['notes'] = '\n'.join(map(self._part, notes))
        functions = [*self._functions(), self._measures()]
        tables = [
            f'{self.words["constant"]} const {kind} {name}[] = {numbers};'
            for (kind, numbers), name in self.translation.tables.items()
        ]
        translated = [function.text for function in self.translation.functions.values()]
        begin = [self._part('head'), *tables, '', *translated]
        sines = self._part(f'sines of {self.real}')
        whole = '\n'.join([*begin, sines, *functions, self._part('end'), ''])
        return '\n'.join(part for line in whole.split('\n') for part in _wrapped(line))

    def _part(self, part: str, **words: Any) -> str:
        # Returns a part of `parts.h` in which texts replace the placeholders `@name@`.
        return filled(parts()[part], self.words | words)

    def _functions(self) -> list[str]:
        robot, chain, at_J = self.robot, self.robot.chain, kernel.JACOBIAN_AT
        T, J = range(12), range(at_J, at_J + 6 * robot.dof)
        twist = range(J.stop, J.stop + 6)
        frames = [chain.frames_at + 16 * frame + k for frame in range(chain.frames) for k in T]
        functions = [
            self._evaluation('frames', chain, kernel.ALL_FRAMES, T=frames),
            self._evaluation('twist', chain, kernel.JACOBIAN, T=T, twist=twist),
            self._factors(),
        ]
        for point, end in {'tool': '', **function_ends(robot)}.items():
            chain = robot.point(point).chain
            functions.append(self._evaluation(f'pose{end}', chain, kernel.POSE, T=T))
            functions.append(self._evaluation(f'jacobian{end}', chain, kernel.JACOBIAN, T=T, J=J))
        return functions

    def _evaluation(self, name: str, chain: Chain, depth: int, **outputs: Sequence[int]) -> str:
        # Returns a function in C that evaluates the arm and writes each array in `outputs`, such
        # as T. For each array, `outputs` has the indices of its numbers in the kernel's row of
        # results.
        prefix, recording = self.words['prefix'], Recorder(self.translation, self.real)
        inputs = ['q', 'qdot'] if 'twist' in outputs else ['q']
        fails = [f'!{prefix}all_finite({vector}, {chain.dof})' for vector in inputs]
        section, lines = (), []
        if self.closure is not None:
            section = recording.array('section', self.closure.width)
            lines.append(f'double section[{self.closure.width}] = {{0}};')
            given = self.closure, Text('q', 'const double *'), Text('section', 'double *')
            call = self.translation.call(source('loops.closing').close, given)
            fails.append(f'{call.text} != 0')
        q, qdot = (recording.array(vector, chain.dof) for vector in ('q', 'qdot'))
        row = _evaluated(copied(chain), q, qdot, depth, recording.sincos, section)
        lines += [f'if ({" || ".join(fails)}) {{']
        lines += [f'    {prefix}no_result({to}, {len(at)});' for to, at in outputs.items()]
        lines += ['    return;', '}']
        lines += recording.lines({to: row[list(at)] for to, at in outputs.items()})
        return self._function(name, inputs, outputs, lines)

    def _function(
        self, name: str, inputs: Iterable[str], outputs: Iterable[str], lines: Iterable[str]
    ) -> str:
        parameters = [f'const {self.real} *{array}' for array in inputs]
        parameters += [f'{self.real} *{array}' for array in outputs]
        body = '\n'.join(f'    {line}' for line in lines)
        return self._part('function', name=name, parameters=', '.join(parameters), body=body)

    def _factors(self) -> str:
        factors, n = self.robot.singularity.factors, self.robot.dof
        if not len(factors.ends):
            return ''
        module, recording = source('measures.factors'), Recorder(self.translation, self.real)
        tape = module.Tape(factors.operations, factors.constants, factors.ends)
        steps = np.empty((tape.steps, n + 1), object)
        recorded = replaced(module, _partial=recording.partial)
        with recorded, replaced(source('forward.chain_pass'), sincos=recording.sincos):
            module._run_tape(tape, n, recording.array('q', n), steps.ravel(), 1)
        names = ', '.join(map(quoted, factors.names[: len(factors.ends)]))
        lines = recording.lines({'values': steps[factors.ends, n]})
        function = self._function('factors', ['q'], ['values'], lines)
        return self._part('factors', factor_names=names, function=function)

    def _measures(self) -> str:
        robot, n = self.robot, self.robot.dof
        task, m = robot.singularity.task, len(robot.singularity.task.rows)
        zero = kernel.RANK_TOLERANCE * task.length
        rows = source('measures.task_rows').TaskRows(
            task.generic_rank, task.axes, task.rotation, task.row_scales, task.column_scales, zero
        )
        arrays = (Text(name, 'double *') for name in ('copy', 'W', 'spare', 'sigma', 'measures'))
        write_scalars = source('measures.singularity')._write_scalars
        return self._part(
            'measures',
            write_scalars=self.translation.call(write_scalars, [n, rows, *arrays, 1]).text,
            W=min(m, n) * (m + n),
            measures=kernel.LOST_AT,
            manipulability=kernel.MANIPULABILITY,
            smallest=kernel.SMALLEST_SINGULAR_VALUE,
            task=' '.join(task.rows),
            and_columns=' and prismatic columns' * bool(robot.prismatic.any()),
            length=f'{task.length:.6g}',
        )

    def _test_words(self) -> dict[str, Any]:
        # Returns the texts for the self-test of the header: joint positions, with exact poses T
        # and Jacobians J. For a header in `float`, also returns bounds of the errors that rounding
        # to `float` causes in T and J.
        robot = self.robot
        q = generic_poses(robot.chain, robot.limits, robot.prismatic)
        if self.real == 'float':
            q = q.astype(np.float32).astype(np.float64)
        T, J = forward_kinematics(robot, q)[:, :3], jacobian(robot, q)
        words: dict[str, Any] = {'q_tested': listed(q[:SELF_TEST_POSES], self.real)}
        row = _single_row(robot.chain, q) if self.real == 'float' else None
        for name, at, exact in (('T', 0, T), ('J', kernel.JACOBIAN_AT, J)):
            exact = exact.reshape(len(q), -1)
            words[f'{name}_tested'], error = listed(exact[:SELF_TEST_POSES]), 0.0
            if row is not None:
                computed = np.broadcast_arrays(*row[at : at + exact.shape[1]], q[:, 0])[:-1]
                error = ERROR_MARGIN * float(np.abs(np.transpose(computed) - exact).max())
            words[f'{name}_error'] = f'{error:.1e}'
        return words


def _evaluated(chain: Any, q: Any, qdot: Any, depth: int, sincos: Any, section: Any = ()) -> Any:
    # Returns the kernel's row of results at q and qdot, computed by plain Python. The entries of q
    # may be arrays, or `Number` objects that record each operation. `section` has the numbers that
    # the closing of loops would write to the row. So no loop is closed here.
    def close(closure: Any, q: Any, into: Any) -> int:
        into[: len(section)] = section
        return 0

    module, row = source('forward.chain_pass'), np.empty(chain.width, object)
    angles = replaced(module, sincos=sincos, _write_quaternion=lambda *_: None)
    with angles, replaced(source('loops.closing'), close=close):
        source('loops.closed_pass').evaluate_row(chain, q, qdot, depth, row)
    return row


def _single_row(chain: Chain, q: Floats) -> Any:
    # Returns the kernel's row of results in single precision, at N joint positions q (N, n). Each
    # entry of the row is an array (N,).
    single, numbers = copied(chain), np.empty(chain.dof, object)
    for name, field in vars(single).items():
        if isinstance(field, np.ndarray) and field.dtype == float:
            setattr(single, name, field.astype(np.float32))
    numbers[:] = list(q.T.astype(np.float32))
    return _evaluated(single, numbers, numbers, kernel.JACOBIAN, lambda x: (np.sin(x), np.cos(x)))


def _wrapped(line: str) -> list[str]:
    # Returns a line of C as lines of at most WIDTH columns.
    indent = line[: len(line) - len(line.lstrip())]
    indent += '// ' if line.startswith('// ') else '    '
    return textwrap.wrap(
        line, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    ) or ['']


def _plain(text: str) -> str:
    # Returns a text for a C comment. Each backslash, each ? and each character that is not
    # printable ASCII becomes _. A backslash or the trigraph ??/ at the end of a line would
    # continue the comment.
    return re.sub(r'[^ -~]|[\\?]', '_', text)


def filled(template: str, words: Mapping[str, Any]) -> str:
    """Return a template in which each placeholder `@name@` is replaced by `words[name]`."""
    return re.sub(r'@(\w+)@', lambda match: str(words[match[1]]), template)


def quoted(text: str) -> str:
    """Return a text as a literal of C or C++."""
    # Octal escapes have three digits, so that a digit may follow. Spaces are escaped, too, because
    # `_wrapped` breaks lines of C at spaces.
    plain = (chr(k) if 32 < k < 127 and k not in b'"\\?' else f'\\{k:03o}' for k in text.encode())
    return f'"{"".join(plain)}"'


def function_ends(robot: Robot) -> dict[str, str]:
    """
    Return an ending of C function names for each named point, by the name of the point.

    For example, the functions for the point `camera` end in `_of_camera`.
    """
    ends = {name: '_of_' + re.sub(r'\W', '_', name, flags=re.ASCII) for name in robot.points[1:]}
    if len(set(ends.values())) < len(ends):
        raise KinematicsError(
            f'{robot.name}: the names of points must differ in letters, digits and underscores: '
            f'{", ".join(ends)}'
        )
    return ends
