# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read datasets for robot learning: episodes in LeRobot folders, parquet, HDF5 and npz files."""
