"""
After `make_ready` no target finds a function that is still to be compiled.

"""

import subprocess
import sys

# In a process of its own: other tests have reached everything already.
ASKED = """
import numpy as np
import kinematics_service as ks
from kinematics_service import kernel
from kinematics_service.inverse.ready import make_ready

def reached():
    # How many signatures each function has been compiled for, or read from the cache.
    functions = {name: getattr(kernel, name) for name in dir(kernel)}
    return {
        name: len(function.signatures)
        for name, function in functions.items()
        if hasattr(function, 'signatures')
    }

robots = [ks.load_robot(name) for name in ks.bundled_robots()]
states = []
for robot in robots:
    rng = np.random.default_rng(3)
    states += [(robot, ks.evaluate(robot, q, q)) for q in rng.uniform(-1, 1, (2, robot.dof))]
    states.append((robot, ks.evaluate(robot, np.zeros(robot.dof), np.zeros(robot.dof))))
make_ready()
before = reached()
for robot, state in states:
    for target in (state.pose, state.pose[:3, 3], state.pose[:3, 3] + 50.0):
        for every in (True, False):
            ks.inverse_kinematics(robot, target, near=state.q, all_solutions=every)
            ks.inverse_kinematics(robot, target, respect_limits=False, all_solutions=every)
    ks.joint_velocity(robot, state, np.full(6, 0.1))
after = reached()
print({name: after[name] - before[name] for name in after if after[name] != before[name]})
"""


def test_everything_is_reached():
    done = subprocess.run(
        [sys.executable, '-c', ASKED], capture_output=True, text=True, timeout=300
    )
    assert (done.stdout.strip(), done.stderr) == ('{}', '')
