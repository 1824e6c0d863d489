# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an arm as a C++ or C header, whose results are equal to the kernel's, bit for bit.

The kernel's Python source is the only description of the operations. `kernel_source.py` loads it
as plain Python. `recording.py` runs it on numbers that record each operation, which gives the
operations of one arm without loops and branches. `translation.py` translates functions whose
branches depend on the joint positions: the singular values, and the closing of loops. `header.py`
writes both and `parts.h` as one file. `ros2_control.py` adds the files of a ROS 2 package.
"""
