# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw an arm: picture files (`plot`), a live web page (`view`), results in a notebook.

Each picture is first computed as plain data. Then `plots/` draws it with matplotlib, `view/` draws
it with viser, and `notebook.py` writes HTML. `node/drawing/` in the core computes the data of the
live arm.
"""
