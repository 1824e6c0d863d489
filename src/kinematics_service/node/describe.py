# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Return the robot and the conventions of a node as plain data, for the service `~/describe`."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from ..rigid_motion import exact_rpy
from .messages.topics import ANSWERS, DIAGNOSTICS, TARGETS, WARNING
from .parameters.settings import ROW_LABELS, NodeSettings
from .scaling import NO_SAFETY


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def description_of(
    settings: NodeSettings, joint_states: str, topics: Sequence[str], resolve: Callable[[str], str]
) -> dict[str, Any]:
    """
    Return what a program needs to interpret the node's topics: joints with limits and units,
    frames, and the order of rows of the Jacobian and the twist. A joint limit that does not exist
    is None.
    """
    # Import the version only when it is needed, because the import takes 15 ms.
    from ..version import __version__

    robot = settings.robot
    tool = robot.description.tool.motion.matrix
    joints = {
        'name': settings.joint_names,
        'variable': robot.variables,
        'type': robot.joint_types,
        'lower': map(_finite, robot.limits[:, 0]),
        'upper': map(_finite, robot.limits[:, 1]),
        'velocity': map(_finite, robot.velocity_limits),
        'acceleration': map(_finite, robot.acceleration_limits),
        'unit': robot.units,
    }
    return {
        'robot': robot.name,
        'file': {'path': robot.description.file, 'sha256': robot.description.sha256},
        'source': robot.source,
        'convention': robot.convention,
        'dof': robot.dof,
        'joints': [dict(zip(joints, row)) for row in zip(*joints.values())],
        'frames': {'base': settings.base_frame, 'tool': settings.tool_frame},
        'tool': {'xyz': tool[:3, 3].tolist(), 'rpy': list(exact_rpy(tool[:3, :3]))},
        'points': {name: point.tool_frame for name, point in settings.points.items()},
        'jacobian': {
            'axes': settings.jacobian_frame,
            'rows': ROW_LABELS[settings.row_order].split(','),
            'columns': list(settings.joint_names),
            'reference_point': 'origin of the tool frame',
        },
        'twist': {'axes': settings.twist_frame, 'rows': ROW_LABELS['linear_first'].split(',')},
        'acceleration': {
            'axes': settings.twist_frame,
            'window': settings.estimator.acceleration_window * 1e-9,
        },
        'wrench': {'axes': 'tool', 'exerted by': 'the tool', 'at': 'origin of the tool frame'},
        'quaternion': 'x y z w',
        'scale': {
            'rule': 'servo' if settings.scale_rule else 'distance',
            'horizon': settings.values['scale.horizon'],
            'rise': settings.values['scale.rise'],
            'reduced': settings.scale_reduced,
            'speed_limits': {
                limit.of: {
                    name: _finite(getattr(limit, name))
                    for name in ('linear', 'angular', 'reduced')
                }
                for limit in robot.description.speed_limits
            },
            'note': NO_SAFETY,
        },
        'singularity': {
            'task': list(robot.singularity.task.rows),
            'length': robot.singularity.task.length,
            'generic_rank': robot.singularity.task.generic_rank,
            'dependent_joints': list(robot.singularity.task.dependent_joints),
            'measure': robot.singularity.thresholds.measure,
            'warn': robot.singularity.thresholds.warn,
            'stop': robot.singularity.thresholds.stop,
        },
        'subscribes': joint_states,
        'targets': [*map(resolve, TARGETS)],
        'target_rows': list(settings.target_rows),
        'publishes': [*topics, *map(resolve, (WARNING, DIAGNOSTICS, *ANSWERS))],
        'version': __version__,
    }
