"""
The compiled kernel against its source run by plain Python, bit for bit, on every bundled robot.

    python bench/kernel_bits.py [robot ...]

prints each robot and function whose numbers differ, and the sha256 of all of them: machines whose
last line is the same agree to the last bit. Plain Python takes a minute or two.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from kinematics_service.kernel.compiled import VARIABLE

TOUR = Path(__file__).parents[1] / 'test' / 'kernel' / 'kernel_tour.py'


def toured(uncompiled):
    """Return the lines of the tour."""
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    if uncompiled:
        environment[VARIABLE] = '1'
    command = [sys.executable, str(TOUR), *sys.argv[1:]]
    return subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, text=True, check=True
    ).stdout.splitlines()


def main():
    compiled, plain = toured(False), toured(True)
    for line in sorted(set(compiled) ^ set(plain)):
        print('differs:', line)
    print(len(compiled), hashlib.sha256('\n'.join(compiled).encode()).hexdigest())


if __name__ == '__main__':
    main()
