"""
The table of causes a wrong matrix may have, the most telling first; a new cause is a new row.

"""

from . import formula_misreadings as misreadings
from . import formula_slips as slips
from .formula_variant import (
    ALL,
    BLOCK,
    COLUMN,
    ENTRY,
    EVERYWHERE,
    JACOBIAN,
    MATRICES,
    POSES,
    ROW,
    VECTORS,
    WHOLE,
    Cause,
)

ARM = ('tool', 'pose', 'rotation', *VECTORS, *JACOBIAN, 'det')
TABLE = (*ARM, 'row')

CAUSES = (
    Cause('order of the rows', JACOBIAN, (WHOLE,), slips.row_order),
    Cause('tool axes', JACOBIAN, (WHOLE, BLOCK), slips.other_axes),
    Cause('standard or modified DH', (*TABLE, 'general'), (WHOLE,), misreadings.other_convention),
    Cause('matrix not inverted', TABLE, (WHOLE,), misreadings.not_inverted),
    Cause('transpose or inverse', (*MATRICES, *JACOBIAN), (WHOLE,), slips.transposed),
    Cause('index of the axis', JACOBIAN, (WHOLE, BLOCK), slips.axis_index),
    Cause('point of the Jacobian', JACOBIAN, (WHOLE, BLOCK, COLUMN), slips.other_point),
    Cause('sum of columns', JACOBIAN, (COLUMN,), slips.column_sums),
    Cause('order of the columns', JACOBIAN, (WHOLE,), slips.column_order),
    Cause('kind of joint', JACOBIAN, (COLUMN,), slips.joint_type),
    Cause('cross product', JACOBIAN, (WHOLE, BLOCK, COLUMN), slips.moment_arm),
    Cause('degrees', JACOBIAN, (WHOLE, BLOCK, COLUMN), slips.per_degree),
    Cause('millimetres', (*POSES, *VECTORS, *JACOBIAN), (WHOLE, BLOCK, COLUMN), slips.millimetres),
    Cause('derivative of a pose', ('numeric',), (WHOLE,), slips.bottom_row),
    Cause('values of the joints', ALL, (WHOLE,), misreadings.other_joint_value),
    Cause('base and tool', ('tool', 'pose', 'position'), (WHOLE,), slips.base_and_tool),
    Cause('exchanged joints', TABLE, (WHOLE,), misreadings.joint_exchange),
    Cause('zero of a joint', TABLE, (WHOLE,), misreadings.joint_zero),
    Cause('direction of a joint', TABLE, (WHOLE,), misreadings.joint_direction),
    Cause('relative or absolute angles', TABLE, (WHOLE,), misreadings.absolute_angles),
    Cause('missing length', ALL, EVERYWHERE, misreadings.missing_length),
    Cause('exchanged lengths', ALL, EVERYWHERE, misreadings.exchanged_lengths),
    Cause('entry of the table', TABLE, (WHOLE,), misreadings.one_row),
    Cause('row of the table left out', TABLE, (WHOLE,), misreadings.row_left_out),
    Cause('column of the table', TABLE, (WHOLE,), misreadings.shifted_column),
    Cause('something else', ALL, (WHOLE,), slips.another_quantity),
    Cause('sign', ALL, (WHOLE, BLOCK, COLUMN, ROW, ENTRY), slips.sign),
)
