# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
List the mistakes that are tested if a matrix is wrong, the most specific mistake first. To add a
mistake, add a row to `CAUSES`.
"""

from . import misreadings as misreadings
from . import slips as slips
from .variant import (
    ALL,
    BLOCK,
    COLUMN,
    EVERYWHERE,
    JACOBIAN,
    MATRICES,
    POSES,
    VECTORS,
    WHOLE,
    Cause,
)

ARM = ('tool', 'pose', 'rotation', *VECTORS, *JACOBIAN, 'det')
TABLE = (*ARM, 'row')

CAUSES = (
    # Test the sign of a determinant first. Many mistakes below also change only the sign of a
    # determinant. If they were tested first, they would be reported for a wrong sign.
    Cause('sign of the determinant', ('det',), (WHOLE,), slips.sign),
    Cause('axes of the frame itself', ('axis',), (WHOLE,), slips.own_axes),
    Cause('kind of joint', JACOBIAN, (COLUMN,), slips.joint_type),
    Cause('order of the rows', JACOBIAN, (WHOLE,), slips.row_order),
    Cause('tool axes', JACOBIAN, (WHOLE, BLOCK), slips.other_axes),
    Cause('standard or modified DH', (*TABLE, 'general'), (WHOLE,), misreadings.other_convention),
    Cause('matrix not inverted', TABLE, (WHOLE,), misreadings.not_inverted),
    Cause('transpose or inverse', (*MATRICES, *JACOBIAN), (WHOLE,), slips.transposed),
    Cause('index of the axis', JACOBIAN, (WHOLE, BLOCK, COLUMN), slips.axis_index),
    Cause('point of the Jacobian', JACOBIAN, (WHOLE, BLOCK, COLUMN), slips.other_point),
    Cause('sum of columns', JACOBIAN, (COLUMN,), slips.column_sums, many=True),
    Cause('order of the columns', JACOBIAN, (WHOLE,), slips.column_order),
    Cause('cross product', JACOBIAN, (WHOLE, BLOCK, COLUMN), slips.moment_arm),
    Cause('degrees', JACOBIAN, (WHOLE, BLOCK, COLUMN), slips.per_degree),
    Cause('millimetres', (*POSES, *VECTORS, *JACOBIAN), (WHOLE, BLOCK, COLUMN), slips.millimetres),
    Cause('derivative of a pose', ('numeric',), (WHOLE,), slips.bottom_row),
    Cause('base and tool', ('tool', 'pose', 'position'), (WHOLE,), slips.base_and_tool),
    Cause('angles in degrees', ARM, (WHOLE, BLOCK, COLUMN), misreadings.in_degrees, many=True),
    Cause('sine and cosine', ARM, (WHOLE, BLOCK), misreadings.sine_for_cosine, many=True),
    Cause('exchanged joints', TABLE, (WHOLE,), misreadings.joint_exchange, many=True),
    Cause('zero of a joint', TABLE, (WHOLE,), misreadings.joint_zero, many=True),
    Cause('direction of a joint', TABLE, (WHOLE,), misreadings.joint_direction, many=True),
    Cause('relative or absolute angles', TABLE, (WHOLE,), misreadings.absolute_angles, many=True),
    Cause('missing length', ALL, EVERYWHERE, misreadings.missing_length),
    Cause('exchanged lengths', ALL, EVERYWHERE, misreadings.exchanged_lengths, many=True),
    Cause('entry of the table', TABLE, (WHOLE,), misreadings.one_row, many=True),
    Cause('column of the table', TABLE, (WHOLE,), misreadings.shifted_column, many=True),
    Cause('row of the table left out', TABLE, (WHOLE,), misreadings.row_left_out, many=True),
    Cause('another quantity', ALL, (WHOLE,), slips.another_quantity),
    Cause('sign', ALL, EVERYWHERE, slips.sign),
    Cause('values of the joints', ALL, (WHOLE,), misreadings.other_joint_value),
)
