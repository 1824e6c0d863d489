"""
Prints hashes of what the kernel makes of arms with closed loops: the same compiled and not.

    python test/kinematics/loop_numbers.py five_bar crank_slider
    python test/kinematics/loop_numbers.py robot.pickle
"""

import hashlib
import pickle
import sys
from pathlib import Path

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics import singularity_rates

POSES = 12
# Poses that are searched: plain Python takes seconds for each.
SEARCHED = 1


def lines(names):
    """Yield a line for each arm, of a bundled name or pickled."""
    for name in names:
        pickled = Path(name).suffix == '.pickle'
        robot = pickle.loads(Path(name).read_bytes()) if pickled else ks.load_robot(name)
        assembled = robot.chain.closure.assembled()
        far = 0.03 if robot.chain.groups < robot.chain.loops else 0.3  # small machines
        share = np.linspace(-far, far, POSES)[:, None] * np.arange(1, robot.dof + 1)
        q = assembled + np.minimum(robot.chain.closure.units(), 1.0) * share / robot.dof
        state = ks.evaluate(robot, q, np.ones_like(q), kernel.ALL_FRAMES)
        digest = hashlib.sha256(state.numbers.tobytes())
        digest.update(singularity_rates.measures_of(state).tobytes())
        few = ks.evaluate(robot, q[:SEARCHED])
        measures = singularity_rates.measures_of(few)
        digest.update(singularity_rates.searched(few, measures).tobytes())
        yield f'{name} {digest.hexdigest()}'


def main():
    """Print the lines of the arms of the command line."""
    for line in lines(sys.argv[1:]):
        print(line)


if __name__ == '__main__':
    main()
