# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Prints hashes of what the kernel makes of arms with closed loops: the same compiled and not.

    python test/kinematics/loop_numbers.py five_bar crank_slider
    python test/kinematics/loop_numbers.py robot.pickle
"""

import dataclasses
import hashlib
import pickle
import sys
from pathlib import Path
from unittest import mock

import numpy as np

import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.kinematics import singularity_rates
from kinematics_service.robot.joint_spans import joint_spans

POSES = 12
# The pose whose nearest singular pose is searched: plain Python takes 6 s for the first one of a
# crank slider, which is far from singular.
SEARCHED = 4
# The most joints of an arm that is searched: plain Python takes 16 s for the six of a hexapod.
SEARCHED_JOINTS = 3


def with_few_seeds(robot):
    """Return the arm with one joint that counts for the seeds of singular poses: ten of them."""
    model = dataclasses.replace(robot.singularity)
    spans = joint_spans(model.chain, model.task, model.limits)
    spans[1:, 1] = 0.0
    with mock.patch('kinematics_service.robot.singularity_model.joint_spans', return_value=spans):
        model.arm.atlas()
    return dataclasses.replace(robot, singularity=model)


def lines(names):
    """Yield a line for each arm, of a bundled name or pickled."""
    for name in names:
        if Path(name).suffix == '.pickle':
            robot = pickle.loads(Path(name).read_bytes())
        else:
            robot = ks.load_robot(name)
        assembled = robot.chain.closure.assembled()
        far = 0.03 if robot.chain.groups < robot.chain.loops else 0.3  # small machines
        share = np.linspace(-far, far, POSES)[:, None] * np.arange(1, robot.dof + 1)
        q = assembled + np.minimum(robot.chain.closure.units(), 1.0) * share / robot.dof
        state = ks.evaluate(robot, q, np.ones_like(q), kernel.ALL_FRAMES)
        digest = hashlib.sha256(state.numbers.tobytes())
        digest.update(singularity_rates.measures_of(state).tobytes())
        if robot.dof <= SEARCHED_JOINTS:
            one = ks.evaluate(with_few_seeds(robot), q[SEARCHED : SEARCHED + 1])
            measures = singularity_rates.measures_of(one)
            digest.update(singularity_rates.searched(one, measures).tobytes())
        yield f'{name} {digest.hexdigest()}'


def main():
    """Print the lines of the arms of the command line."""
    for line in lines(sys.argv[1:]):
        print(line)


if __name__ == '__main__':
    main()
