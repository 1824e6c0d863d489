# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Import matplotlib's classes for type annotations only; at run time, they are `Any`."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.artist import Artist as Artist
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
    from mpl_toolkits.mplot3d import Axes3D as Axes3D
else:
    Artist = Axes = Axes3D = Figure = Any
