# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Show an arm live on a web page; the content is computed as plain data, then drawn with viser.
"""
