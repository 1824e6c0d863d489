# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where things are that tests read."""

import os
from pathlib import Path

ROOT = Path(__file__).parents[1]
GOLDEN = ROOT / 'test' / 'golden'
CONFIG = ROOT / 'config'
BENCH = ROOT / 'bench'
# Recordings of real robots are no part of the project; without them their tests skip.
RECORDINGS = Path(os.environ.get('KINEMATICS_RECORDINGS') or ROOT.parent / 'shared' / 'recordings')
