# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Compare a file of formulas with a robot at random configurations: find entries that differ, and
why.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ....errors import FormulaError
from ....robot.robot import Robot
from ..arm.numbers import Floats
from ..arm.table import table_of
from .arm.quantities import ACCEPTED
from .arm.symbols import shown
from .causes.explanation import Explained, Explanation, explain, right_entry
from .causes.slips import another_quantity
from .causes.variant import MATRICES
from .statements.checks import ROUND_OFF, Check, QuantityCheck
from .statements.claims import judge_claims
from .statements.names import FormulaNames
from .statements.poses import Poses, poses_for
from .statements.solutions import (
    BRANCH_POSE_RATIO,
    MIN_HIT_RATIO,
    EquationCheck,
    PassiveJointCheck,
    SolutionCheck,
)
from .statements.statements import TOO_DEEP, Statement, Understood, understand
from .text.file import Settings, read_formulas

AGREES, DIFFERS = 'agrees', 'differs'
BRANCH_POSES = 200
# Limit of the fraction of configurations at which an inverse kinematics formula gives a solution.
# Below the limit, a remark states the fraction of configurations without a solution. The limit is
# below 1, because a right formula may seem to fail at one or two of 200 configurations: acos near
# -1 and 1 loses too many digits.
MIN_REMARKED_RATIO = 0.99


@dataclass(frozen=True)
class WrongEntry:
    """
    An entry of a formula that differs from the correct value.

    Parameters
    ----------
    row, column
        Indices of the entry, counted from 0.
    yours, right
        The entry as the user wrote it, and the right one, as text: expression or number. `right`
        may be empty.
    difference
        The largest difference over all configurations, SI units.
    """

    row: int
    column: int
    yours: str
    right: str
    difference: float


@dataclass(frozen=True)
class Verdict:
    """
    The result of one formula.

    Parameters
    ----------
    status
        `agrees` or `differs`.
    entries
        The wrong entries.
    causes
        The causes that explain wrong entries, the cause that explains the most entries first.
    unexplained
        Number of wrong entries that no cause explains.
    tried
        Every cause that was tested.
    remarks
        Other facts as sentences: a rotation matrix has determinant -1, the Jacobian is singular at
        every configuration, or an inverse kinematics formula gives another branch.
    shape
        Number of rows and of columns of the formula.
    """

    name: str
    line: int
    status: str
    shape: tuple[int, int]
    entries: tuple[WrongEntry, ...] = ()
    causes: tuple[Explanation, ...] = ()
    unexplained: int = 0
    tried: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """
    The verdicts on the formulas of a file, in the order of the file, and the errors of its lines.

    Parameters
    ----------
    poses
        Number of random configurations.
    randomised
        Names of the constants that got random values.
    passed_over
        Messages about definitions that no formula uses.
    """

    robot: Robot
    verdicts: tuple[Verdict, ...]
    faults: tuple[FormulaError, ...]
    poses: int
    randomised: tuple[str, ...]
    passed_over: tuple[FormulaError, ...] = ()

    @property
    def agrees(self) -> bool:
        """Return whether every formula of the file is right."""
        return all(verdict.status == AGREES for verdict in self.verdicts)


def compare(robot: Robot, text: str) -> Comparison:
    """
    Return the comparison of a robot with the formulas in a text.

    Parameters
    ----------
    robot
        The arm.
    text
        Formulas in plain, sympy, MATLAB or LaTeX syntax. Formulas of an arm with closed loops may
        contain joints and passive joints; they are compared at configurations at which the loops
        close.
    """
    names = FormulaNames(table_of(robot.description))
    understood = understand(read_formulas(text), names)
    verdicts: list[Verdict] = []
    checks: list[Check] = []
    faults = list(understood.faults)
    for statement in understood.statements:
        if statement.kind == 'claim':
            continue
        try:
            checks.append(_check(robot, names, statement, understood))
            verdicts.append(_verdict(checks[-1]))
        except FormulaError as fault:
            faults.append(fault if fault.line else statement.fault(fault.message, fault.code))
        except RecursionError:
            faults.append(statement.fault(f'{statement.name}: {TOO_DEEP}', 'too-deep'))
    verdicts = _with_the_others(verdicts, checks)
    claims = [statement for statement in understood.statements if statement.kind == 'claim']
    if claims and names.table.passive:
        message = 'singular: not compared for an arm with closed loops; remove the line'
        faults.append(claims[0].fault(message, 'unsupported'))
    if claims and not faults:
        for claim in judge_claims(robot, names, claims):
            status = (DIFFERS, AGREES)[claim.holds]
            verdicts.append(Verdict(claim.name, claim.line, status, (1, 1), remarks=claim.remarks))
    if not understood.statements and not faults:
        message = "the file has no formula; write for example 'J = [...]' or 'T = [...]'"
        none = FormulaError(message, 1, 1, code='empty')
        faults += [
            FormulaError(
                f'{fault.message}; known: {ACCEPTED}', fault.line, fault.column, code=fault.code
            )
            for fault in understood.passed_over
        ] or [none]
    verdicts.sort(key=lambda verdict: verdict.line)
    faults.sort(key=lambda fault: (fault.line, fault.column))
    count = max((check.poses.count for check in checks), default=0)
    randomised = tuple(dict.fromkeys(name for check in checks for name in check.poses.randomised))
    return Comparison(
        robot, tuple(verdicts), tuple(faults), count, randomised, understood.passed_over
    )


def _check(
    robot: Robot, names: FormulaNames, statement: Statement, understood: Understood
) -> Check:
    symbols, settings = statement.symbols, statement.settings

    def poses(count: int, symbols: frozenset[sp.Symbol] = symbols) -> Poses:
        return poses_for(robot, names, settings, symbols, understood.fixed, count)

    if statement.kind == 'quantity':
        readings = QuantityCheck(robot, names, statement, poses(8)).readings
        return next((c for c in readings if c.fits and not c.wrong.any()), readings[0])
    if statement.kind == 'equation':
        return EquationCheck(robot, names, statement, poses(8))
    if names.table.passive:
        if statement.joint < names.table.joints:
            raise statement.fault(
                f'{statement.name}: inverse kinematics is not compared for an arm with closed '
                'loops; write formulas of passive joints',
                'unsupported',
            )
        return PassiveJointCheck(robot, names, statement, poses(8))
    solutions = (s for s in understood.statements if s.kind == 'solution')
    others = tuple(s for s in solutions if s.settings == settings)
    together = frozenset().union(*(s.symbols for s in others))
    return SolutionCheck(robot, names, statement, poses(BRANCH_POSES, together), others)


def _verdict(check: Check) -> Verdict:
    statement = check.statement
    base = Verdict(statement.name, statement.line, AGREES, check.shape)
    if isinstance(check, QuantityCheck):
        if np.isnan(check.right).any():
            task = ' '.join(check.robot.singularity.task.rows)
            raise statement.fault(
                f'{statement.name}: the Jacobian of the task ({task}) has '
                f'{check.names.table.joints} columns and no determinant; compare J instead',
                'wrong-shape',
            )
        if not check.fits:
            return _misshapen(check, base)
        base = replace(
            base, remarks=(*check.reading_in_words, *_facts(check)), labels=check.labels
        )
    if isinstance(check, SolutionCheck):
        base = replace(base, remarks=tuple(_branch(check)))
    if not check.wrong.any():
        return replace(base, remarks=base.remarks + _rounded(check))
    # Do not search causes if the arm has passive joints, because the search ignores closed loops.
    explained = Explained((), ()) if check.names.table.passive else explain(check)
    entries = tuple(_wrong_entry(check, int(i), int(j)) for i, j in np.argwhere(check.wrong))
    covered = {entry for cause in explained.explanations for entry in cause.entries}
    return replace(
        base,
        status=DIFFERS,
        entries=entries,
        causes=explained.explanations,
        unexplained=len(entries) - len(covered),
        tried=explained.tried,
    )


def _rounded(check: Check) -> tuple[str, ...]:
    # If the formula has rounded decimals and agrees only within their rounding, return a remark
    # with the largest difference.
    worst = float(np.max(check.gap(check.person, check.right)))
    rounded = check.statement.decimals or check.statement.half_units
    if not rounded or worst <= ROUND_OFF:
        return ()
    places = f'{check.statement.decimals} ' if check.statement.decimals else ''
    return (f'to the {places}decimals given; the largest difference is {worst:.2g}',)


def _misshapen(check: QuantityCheck, base: Verdict) -> Verdict:
    rows, columns = check.right.shape[1:]
    name, (had, wide) = check.statement.name, check.shape
    remarks = [f'{name} is {rows} x {columns}, not {had} x {wide}']
    table = check.names.table
    if check.quantity.kind == 'jacobian' and had in (rows, 3) and 1 < wide < columns:
        right = check.right if had == rows else check.right[:, :3]
        missing = [
            str(table.variables[k])
            for k in range(columns)
            if not any(
                check.agrees(check.person[:, :, j], right[:, :, k]).all() for j in range(wide)
            )
        ]
        remarks.append(f'columns that are not there: those of {", ".join(missing)}')
    if had == rows and columns == 1:
        remarks += [
            f'its column {j + 1} is right'
            for j in range(wide)
            if check.agrees(check.person[:, :, j], check.right[:, :, 0]).all()
        ]
    for variant in () if table.passive else another_quantity(check):
        if check.agrees(check.person, variant.values).all():
            remarks.append(variant.sentence)
            break
    return replace(base, status=DIFFERS, remarks=tuple(remarks), tried=('another quantity',))


def _wrong_entry(check: Check, i: int, j: int) -> WrongEntry:
    yours = check.person[:, i, j]
    right = check.right[:, i, j]
    gap = check.gap(yours, right)
    worst = float(np.max(np.abs(yours - right))) if np.isfinite(gap).all() else np.inf
    expression = check.expressions[i, j]
    text = shown(expression) or f'{yours[0]:.6g} at pose 1'
    fixed = check.is_one_configuration or not np.ptp(right)
    whole = not check.names.table.passive and not check.is_one_configuration
    entry = right_entry(check, i, j) if isinstance(check, QuantityCheck) and whole else None
    proper = '' if entry is None else shown(entry)
    if not proper and not isinstance(check, SolutionCheck):
        value = right[0] if abs(right[0]) > 1e-12 else 0.0
        proper = f'{value:.6g}' + ('' if fixed else ' at pose 1')
        if expression.free_symbols:
            text += f' ({yours[0]:.6g} at pose 1)'
    return WrongEntry(i, j, text, proper, worst)


def _facts(check: QuantityCheck) -> list[str]:
    kind, task = check.quantity.kind, check.robot.singularity.task
    if kind in MATRICES and min(check.shape) >= 3:
        return _rotation_facts(check.person[:, :3, :3])
    if kind != 'det' or not task.structurally_deficient:
        return []
    rank, full = task.generic_rank, min(len(task.rows), check.robot.dof)
    joints = ', '.join(task.dependent_joints)
    because = f': the motions of {joints} cancel' if joints else ''
    return [
        f'the determinant is 0 at every pose, not only here: the rank is at most {rank} of {full}'
        f'{because}. A structural property, no singular configuration'
    ]


def _rotation_facts(R: Floats) -> list[str]:
    with np.errstate(all='ignore'):
        determinants = np.linalg.det(R)
        off = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max()
    if not np.isfinite(off):
        return []
    if np.allclose(determinants, -1.0, atol=1e-6) and off < 1e-3:
        return ['not a rotation: its determinant is -1, a mirror image']
    if off > 1e-3:
        low, high = determinants.min(), determinants.max()
        value = f'{low + 0.0:.4g}' if high - low < 1e-6 else f'{low:.4g} to {high:.4g}'
        return [f'not a rotation: its columns are not orthogonal unit vectors, det {value}']
    return []


def _branch(check: SolutionCheck) -> list[str]:
    hit_ratio, solved = check.hit_ratio, check.solved
    if hit_ratio >= 1.0:
        return []
    if bool(check.wrong.any()):
        slides = any(check.names.table.slides)
        if slides and hit_ratio + (1.0 - hit_ratio) * check.branches(None) >= BRANCH_POSE_RATIO:
            return ['gives another branch, with a length outside its limits']
        if solved < MIN_HIT_RATIO:
            return []
        arctangent = check.expressions.has(sp.atan)
        reason = '; atan cannot tell the quadrants apart, atan2 can' if arctangent else ''
        return [f'right, or another branch, at {solved:.0%} of the poses only{reason}']
    beside = f'; no solution at {1.0 - solved:.0%}' if solved < MIN_REMARKED_RATIO else ''
    if hit_ratio < MIN_HIT_RATIO:
        return [
            'gives another branch: with other values of the other joints the tool is there too'
            + beside
        ]
    hit = f'gives one of several solutions: the joint itself at {hit_ratio:.0%} of the poses'
    if check.together == 1.0:
        return [f"{hit}; with the file's other formulas the tool always reaches its place"]
    return [hit + beside]


def _with_the_others(verdicts: Sequence[Verdict], checks: Sequence[Check]) -> list[Verdict]:
    # Inverse kinematics formulas may each be right alone, but belong to different solutions. Give
    # such formulas the status `differs`.
    right = {verdict.line for verdict in verdicts if verdict.status == AGREES}
    groups: dict[Settings, list[SolutionCheck]] = {}
    for check in checks:
        if isinstance(check, SolutionCheck) and check.statement.line in right:
            groups.setdefault(check.statement.settings, []).append(check)
    apart: dict[int, str] = {}
    for group in groups.values():
        first = replace(group[0], others=tuple(check.statement for check in group))
        hits_all = all(check.hit_ratio == 1.0 for check in group)
        if hits_all or first.together is None or first.together >= BRANCH_POSE_RATIO:
            continue
        names = ', '.join(dict.fromkeys(check.statement.name for check in group))
        times = f'at {first.together:.0%} of the poses only' if first.together else 'at no pose'
        remark = (
            f'right alone, but together the formulas of {names} bring the tool to its place '
            f'{times}: they belong to different solutions'
        )
        apart |= {check.statement.line: remark for check in group if check.hit_ratio < 1.0}
    return [
        replace(verdict, status=DIFFERS, remarks=(apart[verdict.line],), tried=('another branch',))
        if verdict.line in apart
        else verdict
        for verdict in verdicts
    ]
