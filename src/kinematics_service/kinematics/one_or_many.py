# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Define type variables for results that hold a number for one pose and an array for a batch of
poses.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # A result type that is written without brackets, such as `Singularity`, means one pose. This
    # needs type variables with defaults, which `typing` has from Python 3.13 on.
    from typing_extensions import TypeVar

    from ..kernel import Floats
    from ..robot.measures import Level

    Number = TypeVar('Number', default=float)
    Index = TypeVar('Index', default=int)
    Grade = TypeVar('Grade', default=Level)
    Text = TypeVar('Text', default=str)
    Pose = TypeVar('Pose', default=Floats | None)  # None if the search found no pose
else:
    from typing import TypeVar

    Number, Index, Grade = TypeVar('Number'), TypeVar('Index'), TypeVar('Grade')
    Text, Pose = TypeVar('Text'), TypeVar('Pose')
