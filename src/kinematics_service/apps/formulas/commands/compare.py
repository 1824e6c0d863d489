# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Define the command `compare`, which finds the errors in a user's formulas."""

import sys
from typing import Annotated

import typer

from ....cli.options import JsonOption, RobotArgument, flag, given_robot, given_text
from ....printing import Output, json_text, plain


def compare(
    robot: RobotArgument,
    file: Annotated[
        str, typer.Argument(metavar='FILE', help='The formulas; - reads from a pipe.')
    ],
    json: JsonOption = False,
    verbose: bool = flag(
        '--verbose', 'List the causes that were tested if none explains all errors.'
    ),
) -> None:
    """
    Compare formulas that you derived by hand, or with other software, with the right ones. Print
    the entries that differ, and why.

    Each named cause was tested: your formula, with this mistake repaired, equals the right one at
    random poses, and with random lengths if the robot file has named constants. Exit code 0: all
    agree; 1: something differs; 2: wrong usage, or a file that cannot be read.

    \b
    Example:
      kinematics_service compare craig_3r mine.txt
    \b
    with mine.txt, in plain, sympy, MATLAB or LaTeX syntax, mixed as you like:
      # comments after # or %
      rows: angular first
      J = [  0  -s1  -s1
             0   c1   c1
             1    0    0
            -sin(q1)*r, -c1*h, -L3*s23*c1
             c1*r,      -s1*h, -L3*s23*s1
             0, -L2*c2 - L3*c23, -L3*c23 ]
      where r = L1 + L2 c2 + L3 c23, h = L2 s2 + L3 s23
      T_{12} = \\begin{bmatrix} \\cos q_2 & -\\sin q_2 & 0 & L_1 \\\\ ... \\end{bmatrix}
      det = L2 L3 sin(q3) (L1 + L2 c2 + L3 c23)
      q1 = atan2(y, x)
      singular: q3 = k*pi

    \b
    Names: those of the robot file, with or without underscore, also theta2 or q2 for joint 2;
      c1 = cos(q1), s23 = sin(q2 + q3), L1c23 = L1*c23; x y z, the tool's position, phi its angle
      in the plane; what the file defines itself. A definition that nothing uses is passed over.
    Formulas:
      T, R, p                   tool in the base: pose, rotation, position
      T_03, A_12, H^1_2, R_36   frame 3 in frame 0, 2 in 1; row i of the table ends at frame i
      A_2 or T_2, A_i           matrix of row 2, of every row (a_i, alpha_i, d_i, theta_i)
      R_2, o_2, z_2, p_14       rotation, origin, z axis of frame 2; from o_1 to o_4
      z^1_2, o^1_2, {}^1J       the same, and J, in the axes of frame 1
      J, J_v, J_w, J_2, J_v2    Jacobian: linear rows first, base axes, point: the tool's origin;
                                J with fewer than 6 rows: the task rows, or the rows that are
                                nonzero at some pose (for a planar arm x, y, phi)
      J_s, J_b, J_A             space, body (Lynch and Park: angular rows first), analytic
      det or det(J)             determinant of the task rows of J
      s_o1                      vector from the tool's origin to o_0; s_o2: to o_1
      D_1                       dT/dq1 R^-1: column 1 of J as 4 x 4 matrix
      q2 = ...                  inverse kinematics; all such lines must give one solution
      lhs = rhs                 an equation, such as tan(q1) = y/x; of matrices, each entry
      singular: q3 = k*pi       a family of singular poses, or L2*c2 + L3*c23 = 0; all such lines
                              together must be all singular poses
    Recipes work too: J_w = [z_0, z_1, z_2], J_1 = [cross(z_0, o_3 - o_0); z_0].
    With closed loops, formulas may contain passive joints, and psi1 = ... is a formula, too.
    Settings, which apply to the formulas after them:
      rows: linear first        or: angular first
      frame: base               or: tool; the axes of J
      units: rad                or: deg; angles in the formulas
      at: q1=0, q2=90 deg       a numeric example at one configuration; at: random
      first frame: 0            or: 1; frame 0 is then the base
      point: o_3                the point with the coordinates x, y, z; default: the tool
      meaning: R_C = o_3        a name of your own

    \b
    The keys of --json: robot, file, agrees, poses, random_constants, passed_over (line, message,
    code), formulas; of each formula:
      name, line, status        agrees or differs
      rows, columns, remarks
      entries                   row, column, yours, right, largest_difference (SI units)
      causes                    name, sentence, entries, alternatives: other causes that fit
      unexplained, tested
    The keys if the file has errors: error (code, message, faults); of each fault: file, line,
    column, message, code.
    """
    text = given_text(file)
    arm = given_robot(robot, in_letters=True)
    # Import sympy only when a comparison starts, because sympy takes half a second to load.
    from ..compare.comparison import compare as compare_text
    from ..compare.report import document, error_document, faults_in_words, report

    name = '<stdin>' if file == '-' else file
    comparison = compare_text(arm, text)
    if comparison.faults:
        if json:
            print(json_text(error_document(comparison, name)))
        for sentence in faults_in_words(comparison, name):
            print(sentence, file=sys.stderr)
        raise typer.Exit(2)
    if json:
        print(json_text(document(comparison, name)))
    else:
        out = Output()
        for line in report(comparison, name, verbose):
            out.print(plain(line))
    if not comparison.agrees:
        raise typer.Exit(1)
