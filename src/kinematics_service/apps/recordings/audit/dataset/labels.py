"""Labels of every row of a table: how near it is to a singular pose, and in which branch."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from .....errors import RecordingError
from .....kernel import Floats, NearestSearch
from .....kinematics.singularity import Singularities, measured_in_order, singularity_of
from .....kinematics.tool_state import evaluate
from .....robot.closed_poses import closes_at
from .....robot.robot import AnyRobot, Robot, as_robot
from ...datasets.arms import DatasetArm, arms_of
from ...datasets.episodes import INSTALL
from ...datasets.vectors import Columns, taken_apart, vectors_of_table
from ...readers.arm_columns import arm_columns
from ...readers.joint_format import JointFormat
from ...readers.source import Selection
from ...readers.stamp_format import StampFormat

if TYPE_CHECKING:
    import pyarrow as pa

# Of those that take long; the others are always there.
CLEARANCE = 'clearance'
# A branch is written as bits of the factors' signs.
MOST_FACTORS = 31

Masked: TypeAlias = 'np.ma.MaskedArray[tuple[int, ...], np.dtype[np.generic]]'


def _branch(found: Singularities) -> npt.NDArray[np.int32]:
    # One bit for each factor of the robot file that is positive, or for the determinant.
    if found.factors is not None:
        positive = np.asarray(found.factors.values[..., :MOST_FACTORS] > 0.0, dtype=np.int32)
        return positive @ (1 << np.arange(positive.shape[-1], dtype=np.int32))
    if found.determinant is None:
        return np.zeros(np.shape(found.distance), dtype=np.int32)
    return np.asarray(np.asarray(found.determinant) > 0.0, dtype=np.int32)


LABELS: dict[str, Callable[[Singularities], Floats | npt.NDArray[np.int32]]] = {
    'distance': lambda found: found.distance,
    'manipulability': lambda found: found.manipulability,
    'lost_direction': lambda found: found.lost_direction,
    'branch': _branch,
    CLEARANCE: lambda found: found.clearance,
}


def labels_of(robot: Robot, q: Floats, clearance: bool = False) -> dict[str, Masked]:
    """
    Return labels of joint positions (N, n), rad or m, as arrays (N,) or (N, 6); those of rows that
    are no pose are masked.

    Parameters
    ----------
    clearance
        Whether the clearance is one of them, which takes several times as long.
    """
    good = np.all(np.isfinite(q), axis=1)
    good[good] = closes_at(robot.chain, q[good])
    # In the order of the rows: most are the next ones of a motion.
    state = evaluate(robot, q[good])
    known = singularity_of(measured_in_order(state, NearestSearch(robot.singularity.arm)))
    labels: dict[str, Masked] = {}
    for name, label in LABELS.items():
        if name == CLEARANCE and not clearance:
            continue
        values = np.asarray(label(known))
        whole = np.zeros((len(q), *values.shape[1:]), dtype=values.dtype)
        whole[good] = values
        labels[name] = np.ma.array(whole, mask=False)
        labels[name][~good] = np.ma.masked
    return labels


def labels_of_arms(
    file: Path | str,
    columns: Columns,
    arms: Sequence[DatasetArm],
    clearance: bool,
) -> 'dict[str, pa.Array]':
    """
    Return the labels of columns of numbers as Arrow arrays, null where they are masked; of several
    arms each name begins with the arm's.

    Parameters
    ----------
    file
        Its name, for messages.
    """
    arrays = {}
    for arm in arms:
        robot = arm.reading.robot
        own = arm_columns(file, columns.header, arm.reading)
        q = own.joints.units(robot).positions(columns.chosen(own.positions))
        start = f'{arm.label}.' if arm.label else ''
        for name, values in labels_of(robot, q, clearance).items():
            arrays[start + name] = _arrow_of(values)
    return arrays


def _arrow_of(values: Masked) -> 'pa.Array':
    import pyarrow as pa

    mask = np.ma.getmaskarray(values)
    if values.ndim == 1:
        return pa.array(values.data, mask=mask)
    # Not lists of fixed size: where one is missing, most versions of pyarrow write no such column
    # or cannot read it.
    good = ~mask[:, 0]
    ends = values.shape[1] * np.append(0, np.cumsum(good))
    begins = pa.array(ends, pa.int32(), mask=np.append(~good, False))
    return pa.ListArray.from_arrays(begins, pa.array(values.data[good].reshape(-1)))


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

    It depends on nothing but its arguments, so that Dask, Ray or Spark can call it on the batches
    of a table of any length.

    Parameters
    ----------
    batch
        A `pyarrow.RecordBatch` or `pyarrow.Table` with joint positions.
    robot
        The arm.
    columns, joint_format, joint_prefix
        As the options of `audit`: which columns the joints are (`position=state[0:6]`; default:
        by known names), and their units.
    clearance
        Whether to prove a radius without singular poses, too, which takes several times as long.

    Returns
    -------
    RecordBatch or Table
        With `distance` (rad), `manipulability`, `lost_direction` (6 numbers), `branch`
        (the signs of the factors of the robot file, as bits), and `clearance` (rad) if asked for.
        They are null in rows that are no pose. Of several arms each label begins with the arm's
        name.

    Raises
    ------
    RecordingError
        The joints are not among the columns, or pyarrow is missing.
    """
    try:
        import pyarrow as pa
    except ImportError as error:
        raise RecordingError(INSTALL.format(reason=error)) from None
    robot = as_robot(robot)
    wanted = Selection(
        robot,
        columns=columns,
        joint_prefix=joint_prefix,
        joint_format=JointFormat(joint_format),
        stamps=StampFormat(rate=1.0),
    )
    found = taken_apart(vectors_of_table(batch), {})
    arms = arms_of(found.header, wanted, 0.0)
    added = labels_of_arms('the table', found, arms, clearance)
    twice = [name for name in added if name in batch.schema.names]
    if twice:
        raise RecordingError(f'the table has a column {twice[0]!r} already')
    arrays = [*batch.columns, *added.values()]
    kind = pa.RecordBatch if isinstance(batch, pa.RecordBatch) else pa.Table
    return kind.from_arrays(arrays, names=[*batch.schema.names, *added])
