# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Convert robots to and from URDF, the XML format that RViz, MoveIt and robot_state_publisher read.

`writer.export_urdf` makes a URDF from a robot's table. `importer.import_urdf` makes a robot file
from a chain of a URDF, and measures how exactly the poses of both agree.
"""
