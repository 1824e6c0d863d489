# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the reports of an audit: text, HTML page, JSON, and a bag of the computed messages."""
