# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an arm as one C++ or C header. The kernel's source gives the operations: for open arms they
are recorded and written as straight code, and functions with branches are translated.
"""

import math
import re
from collections.abc import Mapping, Sequence
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
from .straight_code import array, lines_of, partial, sincos
from .tables import Tables, fields_of
from .translation import Translation, literal, wrapped

SELF_TEST_POSES = 3
# A header in float states this multiple of the largest error at 1000 poses, because other poses
# and other sines in the C library may have a larger one.
ERROR_MARGIN = 2.0
LOOP_TIME = """\
// Closed loops are solved in steps from positions at which they close. The time of a call grows
// with the distance from these positions, and is longest where a loop does not close.
"""


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
    return Header(robot, cpp, 'float' if single else 'double').text()


class Header:
    """
    The header of an arm.

    Attributes
    ----------
    words
        The words for the names in `parts.h`. `before` and `prefix` are the start of names that
        programs use, and of other names. `std`, `head` and `constant` come before functions of
        the C library, definitions of functions, and constants.
    """

    def __init__(self, robot: Robot, cpp: bool, real: str) -> None:
        self.robot, self.cpp, self.real = robot, cpp, real
        self.dof, self.closed = robot.dof, robot.chain.loops > 0
        if self.closed and real == 'float':
            raise KinematicsError(
                f'{robot.name}: float does not resolve the residual of closed loops; leave out '
                '--float'
            )
        before = '' if cpp else f'kinematics_{robot.name}_'
        self.words: dict[str, Any] = {
            'before': before,
            'prefix': f'{before}detail_',
            'std': 'std::' if cpp else '',
            'head': 'static inline ',
            'constant': 'constexpr' if cpp else 'static const',
            'void': '' if cpp else 'void',
            'f': '' if cpp else 'f',
            'real': real,
            'dof': self.dof,
            'columns': 6 * self.dof,
            'largest': literal(kernel.LARGEST_REDUCED),
            'poses': SELF_TEST_POSES,
        }

    def text(self) -> str:
        """Return the text of the header."""
        self._measure_errors()
        name = f'kinematics_{self.robot.name}'
        body = [*self._constants(), *self._kernel(), *self._functions(), *self._self_test()]
        end = f'}}  // namespace {name}\n\n' if self.cpp else ''
        return '\n'.join([*self._head(name), *body, '', *self._part('end', end=end), ''])

    def _head(self, name: str) -> list[str]:
        robot = self.robot
        includes = ('cfloat', 'cmath') if self.cpp else ('float.h', 'math.h')
        return self._part(
            'head',
            robot=robot.name,
            language='C++17' if self.cpp else 'C99',
            version=__version__,
            source=_plain(robot.source),
            units=' and '.join(dict.fromkeys(robot.units)),
            joints=_plain(', '.join(robot.joint_names)),
            precision='\n'.join(self._part(self.real)),
            or_loop=' or a loop does not close' * self.closed,
            time=LOOP_TIME * self.closed,
            guard=f'{name.upper()}_{"HPP" if self.cpp else "H"}',
            includes='\n'.join(f'#include <{one}>' for one in includes),
            space=f'\nnamespace {name} {{\n' if self.cpp else '',
        )

    def _part(self, part: str, **words: Any) -> list[str]:
        # Returns the lines of a part of `parts.h` with words for the names in it.
        given = self.words | words
        text = re.sub(r'@(\w+)@', lambda found: str(given[found[1]]), parts()[part])
        return [one for line in text.split('\n') for one in wrapped(line) or ['']]

    def _measure_errors(self) -> None:
        robot, n = self.robot, self.dof
        self.words |= {'pose_error': '0.0', 'jacobian_error': '0.0'}
        self.q = generic_poses(robot.chain, robot.limits, robot.prismatic)
        if self.real == 'float':
            self.q = self.q.astype(np.float32).astype(np.float64)
        self.T = forward_kinematics(robot, self.q)[:, :3].reshape(-1, 12)
        self.J = jacobian(robot, self.q).reshape(-1, 6 * n)
        if self.real == 'float':
            row = _single_row(robot.chain, self.q)
            for name, at, exact in (('pose', 0, self.T), ('jacobian', kernel.JACOBIAN_AT, self.J)):
                found = np.broadcast_arrays(*row[at : at + exact.shape[1]], self.q[:, 0])[:-1]
                error = ERROR_MARGIN * float(np.abs(np.transpose(found) - exact).max())
                self.words[f'{name}_error'] = f'{error:.1e}'

    def _constants(self) -> list[str]:
        robot, before, factors = self.robot, self.words['before'], self.robot.singularity.factors
        names = factors.names[: len(factors.ends)]
        counts = {'dof': self.dof, 'frame_count': robot.chain.frames, 'factor_count': len(names)}
        form = 'constexpr int {} = {};'
        if not self.cpp:
            form = f'enum {{{{ {before}{{}} = {{}} }}}};'
        lines = [form.format(name, count) for name, count in counts.items()]
        limits = {
            'lower_limits': robot.limits[:, 0],
            'upper_limits': robot.limits[:, 1],
            'velocity_limits': robot.velocity_limits,
        }
        start = self.words['constant']
        for name, numbers in limits.items():
            lines.append(f'{start} {self.real} {before}{name}[] = {_listed(numbers, self.real)};')
        words = f'{start} const char *' if self.cpp else f'{start} char *const '
        for name, texts in {'joint_names': robot.joint_names, 'factor_names': names}.items():
            if texts:
                lines.append(f'{words}{before}{name}[] = {{{", ".join(map(quoted, texts))}}};')
        return [one for line in lines for one in wrapped(line)]

    def _kernel(self) -> list[str]:
        # Returns the functions of the kernel, and the tables that they need.
        prefix, task = self.words['prefix'], self.robot.singularity.task
        rows = source('measures.task_rows').TaskRows(
            task.generic_rank,
            task.axes,
            task.rotation,
            task.row_scales,
            task.column_scales,
            kernel.RANK_TOLERANCE * task.length,
        )
        chain = copied(self.robot.chain) if self.closed else None
        fields = fields_of([rows, chain] if self.closed else [rows], prefix)
        translation = Translation(prefix, self.words['std'], self.words['head'], fields)
        needed = {
            'measures.singularity': '_write_scalars',
            'measures.factors': '_partial',
            'forward.chain_pass': 'sincos',
            'loops.closed_pass': 'evaluate_row',
        }
        evaluate = [
            translation.function(getattr(source(module), function))
            for module, function in needed.items()
            if self.closed or not module.startswith('loops')
        ][-1]
        tables = Tables(prefix, self.words['constant'], fields, translation.used)
        self.words['task_rows'] = tables.add(rows)
        lines = ['', *self._part('basics'), '', *tables.structures()]
        end = ['', *self._part(f'sines of {self.real}')]
        if self.closed:
            total = f'{evaluate.name}(&{tables.add(chain)}, q, qdot, depth, row)'
            end += ['', *self._part('evaluate', total=total)]
        lines += [one for line in tables.lines for one in wrapped(line)]
        return [*lines, '', translation.text(), *end]

    def _functions(self) -> list[str]:
        robot, n = self.robot, self.dof
        at_J = kernel.JACOBIAN_AT
        T, J = range(12), range(at_J, at_J + 6 * n)
        twist = range(J.stop, J.stop + 6)
        begins = [robot.chain.frames_at + 16 * k for k in range(robot.chain.frames)]
        frames = [begin + k for begin in begins for k in T]
        lines = self._evaluation('frames', robot.chain, kernel.ALL_FRAMES, {'T': frames})
        for point, end in {'tool': '', **function_ends(robot)}.items():
            chain = robot.point(point).chain
            lines += self._evaluation(f'pose{end}', chain, kernel.POSE, {'T': T})
            lines += self._evaluation(f'jacobian{end}', chain, kernel.JACOBIAN, {'T': T, 'J': J})
        lines += self._evaluation('twist', robot.chain, kernel.JACOBIAN, {'T': T, 'twist': twist})
        lines += self._in_axes_of()
        lines += self._factors()
        task, m = robot.singularity.task, len(robot.singularity.task.rows)
        scaled = 'The smallest singular value, with angular rows'
        scaled += ' and prismatic columns' * bool(robot.prismatic.any())
        scaled += f' times {task.length:.6g} m,'
        for name, words, at in (
            ('manipulability', 'The product of the singular values', kernel.MANIPULABILITY),
            ('smallest_singular_value', scaled, kernel.SMALLEST_SINGULAR_VALUE),
        ):
            sizes = {'W': min(m, n) * (m + n), 'spare': 6 * n, 'count': kernel.LOST_AT}
            given = {'name': name, 'words': words, 'at': at, 'task': ' '.join(task.rows)}
            lines += ['', *self._part('measure', **sizes, **given)]
        return lines

    def _function(
        self, name: str, inputs: Sequence[str], outputs: Sequence[str], body: Sequence[str]
    ) -> list[str]:
        parameters = [f'const {self.real} *{one}' for one in inputs]
        parameters += [f'{self.real} *{one}' for one in outputs]
        head = f'{self.words["head"]}void {self.words["before"]}{name}({", ".join(parameters)})'
        lines = ['', head, '{', *(f'    {line}' for line in body), '}']
        return [one for line in lines for one in wrapped(line) or ['']]

    def _row(self, chain: Chain, depth: int) -> Any:
        # Returns a row of results of an open arm as recorded numbers.
        inputs = array('q', chain.dof), array('qdot', chain.dof)
        return _evaluated(copied(chain), *inputs, depth, sincos)

    def _evaluation(
        self, name: str, chain: Chain, depth: int, outputs: Mapping[str, Sequence[int]]
    ) -> list[str]:
        # Returns a function that writes numbers of a row of results, given by their indices.
        prefix = self.words['prefix']
        inputs = ['q', 'qdot'] if 'twist' in outputs else ['q']
        fill = [f'    {prefix}no_result({to}, {len(at)});' for to, at in outputs.items()]
        if self.closed:
            body = [f'double row[{chain.width}] = {{0}};']
            body += [f'if ({prefix}evaluate_arm(q, {inputs[-1]}, {depth}, row)) {{']
            for to, at in outputs.items():
                for begin, end in _runs(at):
                    place = f'{to} + {begin}' if begin else to
                    body.append(f'    {prefix}copy({place}, {end - begin}, row + {at[begin]});')
            return self._function(name, inputs, list(outputs), [*body, '} else {', *fill, '}'])
        row = self._row(chain, depth)
        results = {
            f'{to}[{k}]': row[one] for to, at in outputs.items() for k, one in enumerate(at)
        }
        tests = ' || '.join(f'!{prefix}all_finite({one}, {chain.dof})' for one in inputs)
        body = [*lines_of(results, prefix, self.real), f'if ({tests}) {{', *fill, '}']
        return self._function(name, inputs, list(outputs), body)

    def _in_axes_of(self) -> list[str]:
        n, T = self.dof, array('T', 12)
        wide = max(6, n)
        module, W = source('measures.singularity'), np.empty(6 * n, object)
        ones = np.ones(6), np.ones(n)
        task = source('measures.task_rows').TaskRows(1, np.arange(6), np.eye(3).ravel(), *ones)
        task.rotation = T.reshape(3, 4)[:, :3].ravel()
        module._fill_task_rows(n, task, array('J', 6 * n), W, wide, 1)
        rows = W.reshape(6, n) if n > 6 else W.reshape(n, 6).T
        results = {f'J_axes[{k}]': number for k, number in enumerate(rows.ravel())}
        lines = lines_of(results, self.words['prefix'], self.real)
        words = '// J_axes: J in the axes of the frame with the pose T, instead of base axes.'
        return ['', words, *self._function('in_axes_of', 'TJ', ['J_axes'], lines)[1:]]

    def _factors(self) -> list[str]:
        factors, n = self.robot.singularity.factors, self.dof
        if not len(factors.ends):
            return []
        module = source('measures.factors')
        tape = module.Tape(factors.operations, factors.constants, factors.ends)
        steps = np.empty((tape.steps, n + 1), object)
        recording = replaced(source('forward.chain_pass'), sincos=sincos)
        with recording, replaced(module, _partial=partial):
            module._run_tape(tape, n, array('q', n), steps.ravel(), 1)
        results = {f'values[{k}]': steps[end, n] for k, end in enumerate(factors.ends)}
        lines = lines_of(results, self.words['prefix'], self.real)
        return self._function('factors', ['q'], ['values'], lines)

    def _self_test(self) -> list[str]:
        tables = []
        for name, numbers in {'q': self.q, 'expected_T': self.T, 'expected_J': self.J}.items():
            kind = self.real if name == 'q' else 'double'
            rows = ', '.join(_listed(row, kind) for row in numbers[:SELF_TEST_POSES])
            size = f'[{SELF_TEST_POSES}][{numbers.shape[1]}]'
            tables += wrapped(f'    static const {kind} {name}{size} = {{{rows}}};')
        return ['', *self._part('self-test', tables='\n'.join(tables))]


def _evaluated(chain: Any, q: Any, qdot: Any, depth: int, sincos: Any) -> Any:
    # Returns a row of results of the kernel's source, for numbers of any kind.
    module, row = source('forward.chain_pass'), np.empty(chain.width, object)
    with replaced(module, sincos=sincos, _write_quaternion=lambda *_: None):
        module.evaluate_row(chain, q, qdot, depth, row)
    return row


def _single_row(chain: Chain, q: Floats) -> Any:
    # Returns a row of results in single precision, each an array (N,), at q (N, n).
    single, numbers = copied(chain), np.empty(chain.dof, object)
    for name, field in vars(single).items():
        if isinstance(field, np.ndarray) and field.dtype == float:
            setattr(single, name, field.astype(np.float32))
    numbers[:] = list(q.T.astype(np.float32))
    return _evaluated(single, numbers, numbers, kernel.JACOBIAN, lambda x: (np.sin(x), np.cos(x)))


def _listed(numbers: Any, kind: str) -> str:
    # Returns numbers as the initial value of an array.
    texts = [
        literal(one) + 'F' * (kind == 'float' and math.isfinite(one)) for one in numbers.tolist()
    ]
    return f'{{{", ".join(texts)}}}'


def _runs(at: Sequence[int]) -> list[tuple[int, int]]:
    # Returns begin and end of the parts of `at` in which each index is the previous one plus 1.
    breaks = [k for k in range(1, len(at)) if at[k] != at[k - 1] + 1]
    return list(zip([0, *breaks], [*breaks, len(at)]))


def _plain(text: str) -> str:
    # Returns a text for a comment of C: without a backslash or a trigraph at the end of a line.
    return re.sub(r'[^ -~]|[\\?]', '_', text)


def quoted(text: str) -> str:
    """Return a text as a literal of C or C++."""
    # Octal escapes have three digits, so that a digit may follow.
    plain = (chr(k) if 32 <= k < 127 and k not in b'"\\?' else f'\\{k:03o}' for k in text.encode())
    return f'"{"".join(plain)}"'


def function_ends(robot: Robot) -> dict[str, str]:
    """Return for each named point of an arm the end of the names of its functions."""
    ends = {name: '_of_' + re.sub(r'\W', '_', name, flags=re.ASCII) for name in robot.points[1:]}
    if len(set(ends.values())) < len(ends):
        raise KinematicsError(
            f'{robot.name}: the names of points must differ in letters, digits and underscores: '
            f'{", ".join(ends)}'
        )
    return ends
