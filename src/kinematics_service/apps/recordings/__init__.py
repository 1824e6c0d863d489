# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Judge recordings, planned trajectories and datasets as a running node would judge them: `audit`.

`readers/` and `datasets/` turn files into blocks of joint states. `audit/` passes the blocks
through the node's state estimator and the compiled kernel of the package, and makes findings;
`audit/report/` writes the page, the JSON document and the bag. `plans/` checks a plan at and
between its points. `sweep.py` audits many recordings or episodes in several processes, or on a
Dask cluster. `commands/` has the command and its options.
"""
