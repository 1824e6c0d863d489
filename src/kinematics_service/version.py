# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Read the version of the package, which comes from `package.xml`."""

from importlib import metadata

__version__ = metadata.version('kinematics_service')
