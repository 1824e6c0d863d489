# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Draw an arm: picture files (`plot`), a live web page (`view`), results in a notebook.

Each picture is first computed as plain data. Then `plots/` draws it with matplotlib, `view/` draws
it with viser, and `notebook.py` writes HTML. The package `node/drawing/` computes the data that
`view/` draws.
"""
