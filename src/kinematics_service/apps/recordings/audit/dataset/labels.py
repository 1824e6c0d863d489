# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Label each row of a table of joint positions: distance to singular poses, branch of the arm, and
other measures.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .....errors import RecordingError
from .....kernel import Floats, NearestSearch
from .....kinematics.singularity import Singularities, singularity_of
from .....kinematics.singularity_rates import measured_in_order
from .....kinematics.tool_state import evaluate
from .....robot.closed_poses import closes_at
from .....robot.robot import AnyRobot, Robot, as_robot
from ...datasets.arms import DatasetArm, arms_of
from ...datasets.episodes import missing_library
from ...datasets.vectors import Columns, taken_apart, vectors_of_table
from ...readers.arm_columns import arm_columns
from ...readers.joint_format import JointFormat
from ...readers.source import Selection
from ...readers.stamp_format import StampFormat

if TYPE_CHECKING:
    import pyarrow as pa

# Name of an optional label: a radius (rad) around the joint positions within which it is proved
# that no pose is singular. The label is optional because it is slow to compute.
CLEARANCE = 'clearance'
# Names of the labels. `branch` holds the signs of the robot file's singular factors (functions
# that are zero at singular poses). The other names are attributes of `Singularity`. Two poses on
# different branches are separated by singular poses.
LABELS = ('distance', 'manipulability', 'lost_direction', 'branch', CLEARANCE)
# Largest number of singular factors in the label `branch`: their signs are the bits of one int32.
MAX_FACTORS = 31


def _branch(singularity: Singularities) -> npt.NDArray[np.int32]:
    # Returns the label `branch` (N,): the signs of the robot file's singular factors as bits.
    # Without factors it is the sign of det J as one bit, or 0 if J is not square.
    if singularity.factors is not None:
        positive = np.asarray(singularity.factors.values[..., :MAX_FACTORS] > 0.0, dtype=np.int32)
        return positive @ (1 << np.arange(positive.shape[-1], dtype=np.int32))
    if singularity.determinant is None:
        return np.zeros(np.shape(singularity.distance), dtype=np.int32)
    return np.asarray(np.asarray(singularity.determinant) > 0.0, dtype=np.int32)


def labels_of(robot: Robot, q: Floats, clearance: bool = False) -> 'dict[str, pa.Array]':
    """
    Return labels of joint positions (N, n), rad or m, as Arrow arrays with N entries.
    `lost_direction` has a list of 6 numbers (a twist) for each row. Every other label has one
    number for each row.

    Labels are null in rows without valid joint positions.

    Parameters
    ----------
    clearance
        Whether to compute the label `clearance` too. The call then takes several times as long.
    """
    import pyarrow as pa

    good = np.all(np.isfinite(q), axis=1)
    good[good] = closes_at(robot.chain, q[good])
    # Evaluate the rows in order, because the search for the nearest singular pose starts from the
    # result of the row before.
    state = evaluate(robot, q[good])
    known = singularity_of(measured_in_order(state, NearestSearch(robot.singularity.arm)))
    rows = pa.array(np.cumsum(good) - 1, mask=~good)
    labels = {}
    for name in LABELS if clearance else LABELS[:-1]:
        values = np.asarray(_branch(known) if name == 'branch' else getattr(known, name))
        array = pa.array(values.reshape(-1))
        if values.ndim > 1:
            # Store lists of variable size, because most versions of pyarrow cannot write or read
            # null in lists of fixed size.
            ends = values.shape[1] * np.arange(len(values) + 1, dtype=np.int32)
            array = pa.ListArray.from_arrays(ends, array)
        labels[name] = array.take(rows)
    return labels


def labels_of_arms(
    file: Path | str, columns: Columns, arms: Sequence[DatasetArm], clearance: bool
) -> 'dict[str, pa.Array]':
    """
    Return the labels of all arms as Arrow arrays, by name. If a dataset has several arms, the name
    of each label begins with the name of the arm.

    Parameters
    ----------
    file
        The name of the dataset's file, for error messages.
    """
    arrays = {}
    for arm in arms:
        robot = arm.reading.robot
        selected = arm_columns(file, columns.header, arm.reading)
        q = selected.joints.units(robot).positions(columns.chosen(selected.positions))
        start = f'{arm.label}.' if arm.label else ''
        for name, values in labels_of(robot, q, clearance).items():
            arrays[start + name] = values
    return arrays


def judge_table(
    batch: 'pa.RecordBatch | pa.Table',
    robot: AnyRobot,
    *,
    columns: str | None = None,
    joint_format: str = '',
    joint_prefix: str = '',
    clearance: bool = False,
) -> 'pa.RecordBatch | pa.Table':
    """
    Return an Arrow record batch, or table, with the labels of its rows as further columns.

    The result depends only on the arguments, so Dask, Ray or Spark can call this function on the
    batches of a table of any length.

    Parameters
    ----------
    batch
        A `pyarrow.RecordBatch` or `pyarrow.Table` with joint positions.
    robot
        The arm.
    columns, joint_format, joint_prefix
        The columns of the joints (such as `position=state[0:6]`; by default columns with known
        names), their units, and the start of the joint names. The syntax is that of the options
        `--columns`, `--joint-format` and `--joint-prefix` of `audit`.
    clearance
        Whether to add `clearance`: a radius (rad) around the joint positions within which it is
        proved that no pose is singular. With `clearance`, the call takes several times as long.

    Returns
    -------
    RecordBatch or Table
        With `distance` (rad), `manipulability`, `lost_direction` (6 numbers), `branch`, and
        `clearance` (rad) if requested. `branch` holds the signs of the robot file's singular
        factors as bits; a singular factor is a function that is zero at singular poses. Labels are
        null in invalid rows. For several arms each label begins with the name of the arm.

    Raises
    ------
    RecordingError
        Columns of the joints are missing, or pyarrow is missing.
    """
    try:
        import pyarrow as pa
    except ImportError as error:
        raise missing_library(error) from None
    robot = as_robot(robot)
    selection = Selection(
        robot,
        columns=columns,
        joint_prefix=joint_prefix,
        joint_format=JointFormat(joint_format),
        stamps=StampFormat(rate=1.0),
    )
    table = taken_apart(vectors_of_table(batch), {})
    arms = arms_of(table.header, selection, 0.0)
    added = labels_of_arms('the table', table, arms, clearance)
    twice = [name for name in added if name in batch.schema.names]
    if twice:
        message = f'the table has a column {twice[0]!r} already; rename it'
        raise RecordingError(message, code='duplicate-name')
    arrays = [*batch.columns, *added.values()]
    kind = pa.RecordBatch if isinstance(batch, pa.RecordBatch) else pa.Table
    return kind.from_arrays(arrays, names=[*batch.schema.names, *added])
