# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Time of an exact derivation of every bundled robot, and of six-joint arms out of seven-joint ones.
"""

import sys
import time

import kinematics_service as ks

LOCKED = [('panda', 'q3', '0'), ('panda', 'q5', '0'), ('kuka_iiwa14', 'A3', '0')]


def main() -> None:
    """
    Print a table: robot, seconds, terms left of the difference of the four Jacobians, factors.
    """
    ks.derive(ks.load_robot('planar_2r'))  # imports are not what is measured
    wanted = sys.argv[1:] or list(ks.bundled_robots())
    cases = [(name, {}) for name in wanted]
    cases += [(name, {joint: value}) for name, joint, value in LOCKED if name in wanted]
    print(f'{"robot":26} {"s":>6}  left  factors')
    for name, locked in cases:
        begin = time.perf_counter()
        derivation = ks.derive(ks.load_robot(name), locked)
        seconds = time.perf_counter() - begin
        left = sum(derivation.methods.values())
        found = derivation.singular_set
        names = (
            ', '.join(n if len(n) < 30 else 'irreducible' for n in derivation.factors) or 'none'
        )
        kind = '' if found.determinant.square else f' (of {found.determinant.minors} minors)'
        title = name + ''.join(f' {j}={v}' for j, v in locked.items())
        print(f'{title:26} {seconds:6.2f}  {left:4}  {names}{kind}', flush=True)


if __name__ == '__main__':
    main()
