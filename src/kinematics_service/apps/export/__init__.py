# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Write an arm as a C++ or C header, whose results are equal to the kernel's, bit for bit.

The kernel's Python source is the only description of the operations. `kernel_source.py` loads it
as plain Python. `recording.py` runs this source for one arm with numbers that record each
operation. The record has neither loops nor branches. `translation.py` translates functions whose
branches depend on the joint positions: the singular values, and the closing of loops. `header.py`
writes the recorded operations, the translated functions and `parts.h` as one file.
`ros2_control.py` adds the files of a ROS 2 package.
"""
