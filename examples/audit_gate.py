# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
A gate for CI: every planned trajectory of a folder is proved to keep away from singular poses and
limits.

    python examples/audit_gate.py ur5e plans/

Exit code 0 where all plans pass, 1 where one fails. The command `audit` does the work; this script
only says in a line for each plan what a person looks for in a log.
"""

import json
import subprocess
import sys
from pathlib import Path

GATE = 'stop,undecided,limits'


def audited(robot, plan):
    """Return whether a plan passes, and what is said of it."""
    command = [sys.executable, '-m', 'kinematics_service', 'audit', str(plan), '--robot', robot]
    result = subprocess.run(
        [*command, '--fail-on', GATE, '--json', '-'], capture_output=True, text=True, check=False
    )
    if not result.stdout.startswith('{'):
        return False, result.stderr.strip()
    verdict = json.loads(result.stdout)['verdict']
    return result.returncode == 0, ' '.join(line['sentence'] for line in verdict)


def main(robot, folder):
    """Return the exit code for a folder of plans."""
    plans = sorted(Path(folder).glob('*.yaml'))
    failed = 0
    for plan in plans:
        passes, sentence = audited(robot, plan)
        failed += not passes
        print(f'{"pass" if passes else "FAIL"}  {plan.name}: {sentence}')
    print(f'{len(plans) - failed} of {len(plans)} plans pass')
    return 1 if failed or not plans else 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
