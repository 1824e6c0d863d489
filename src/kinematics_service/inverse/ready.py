"""
Every compiled function of inverse kinematics, reached once.

"""

import functools

import numpy as np

from ..robot import load_robot
from ..tool_state import evaluate
from .servo import joint_velocity
from .solve import inverse_kinematics

# Arms with their joint positions: a closed form, a search, and a redundant arm.
ARMS = {
    'puma560': (0.3, -0.4, 0.5, 0.6, 0.7, 0.8),
    'scara_hsr065': (0.3, 0.4, 0.05, 0.2),
    'panda': (0.1, -0.4, 0.2, -1.8, 0.1, 1.6, 0.5),
}


@functools.cache
def make_ready() -> None:
    """
    Answer a few questions, so that everything is compiled or read from its cache.

    Asked are poses that are reached, one that is out of reach, and one where the arm can move
    without moving its tool: a first target of any of these kinds would otherwise take seconds. The
    functions are the same for all arms, so once in a process is enough.

    """
    for name, q in ARMS.items():
        robot = load_robot(name)
        state = evaluate(robot, q, q)
        far = state.pose.copy()
        far[:3, 3] += 1e3  # m
        singular = evaluate(robot, np.zeros(robot.dof)).pose
        for target in (state.pose, far, singular):
            inverse_kinematics(robot, target)
            inverse_kinematics(robot, target, all_solutions=False)
        joint_velocity(robot, state, state.twist)
