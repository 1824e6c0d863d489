# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Arms that obey `ks.scale` at 500 Hz: what they keep, and where they are slowed without need.

    python bench/slowed.py [--commands 100] [--seconds 0.8] [--arms ur5e,panda] [--worst 3]

Each command is a joint velocity that is held: some by chance, some towards the nearest singular
pose, some towards a limit. All joints have limits of 2 rad or m, 2 rad/s or m/s, and brake by 6 of
them a second. Counted are

limit     commands that led beyond a limit
singular  commands that led nearer to a singular pose than the distance `stop` (or than it began)
braked    commands that asked for more than 1.1 of the deceleration, in the mean of 10 steps
needless  commands first slowed although no limit comes on 1.1 of the way of a stop, and nothing
          singular within 1.1 of the distance `stop`
"""

import argparse
import dataclasses
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import kinematics_service as ks
from kinematics_service.robot.robot import build_robot

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

from arms import robot_of

ARMS = (
    'planar_2r,planar_3r,craig_3r,scara_hsr065,rrp_elementary,puma560,ur5e,panda,'
    'offset_stanford_shape,six_joint_dh'
)
STEP, HORIZON = 0.002, 0.05  # s
BOUND, SPEED, BRAKES = 2.0, 1.9, 6.0
# How exactly the distance of a pose is found, rad.
FOUND = 1e-3
# The way of a stop is looked at so finely; the first step begins at the command.
SAMPLES, AVERAGED = 25, 10
# A start is calm: all of the command is kept, and a singular pose is so far, rad.
CALM = 0.25


class Drive(NamedTuple):
    """Commands (N, n) with the ways (steps + 1, N, n) and shares (steps, N) that came of them."""

    commands: np.ndarray
    ways: np.ndarray
    shares: np.ndarray


def limited(robot):
    """Return an arm whose joints all have limits of position, velocity and acceleration."""
    joints = tuple(
        dataclasses.replace(
            joint, lower=-BOUND, upper=BOUND, velocity=SPEED * 1.05, acceleration=BRAKES
        )
        for joint in robot.description.joints
    )
    return build_robot(dataclasses.replace(robot.description, joints=joints))


def starts(robot, count, random):
    """Return poses and commands (count, n) of which all is kept."""
    poses, commands = [], []
    while len(poses) < count:
        q = random.uniform(-BOUND, BOUND, (count, robot.dof))
        target = ks.singularity(robot, q).nearest_singular - q
        by_chance = random.normal(size=q.shape)
        target = np.where(np.isnan(target), by_chance, target)
        kinds = np.arange(count)[:, None] % 2
        command = np.where(kinds == 0, by_chance, target + 0.1 * by_chance)
        command *= SPEED / np.max(np.abs(command), axis=1, keepdims=True)
        calm = ks.scale(robot, q, command, horizon=HORIZON).value == 1.0
        calm &= ks.singularity(robot, q).distance > CALM
        poses += [*q[calm]]
        commands += [*command[calm]]
    return np.array(poses[:count]), np.array(commands[:count])


def driven(robot, q, commands, seconds):
    """Return what comes of commands that are scaled at every step."""
    ways, shares = [q], []
    for _ in range(round(seconds / STEP)):
        shares.append(ks.scale(robot, ways[-1], commands, horizon=HORIZON).value)
        ways.append(ways[-1] + STEP * shares[-1][:, None] * commands)
    return Drive(commands, np.array(ways), np.array(shares))


def least_distances(robot, ways):
    """Return the least distance (N,) on ways (steps, N, n)."""
    return np.min(ks.singularity(robot, ways).distance, axis=0)


def judged(robot, drive):
    """Return which commands (N,) led to each of the four kinds, and how hard each braked."""
    commands, ways, shares = drive
    stop = robot.singularity.thresholds.stop
    least = least_distances(robot, ways[::5])
    begun = ks.singularity(robot, ways[0]).distance
    slowed = (shares[:-AVERAGED] - shares[AVERAGED:]) / (AVERAGED * STEP)
    hardest = np.max(slowed, axis=0) * np.max(np.abs(commands), axis=1) / BRAKES
    return hardest, {
        'limit': np.max(np.abs(ways), axis=(0, 2)) > BOUND + 1e-9,
        'singular': least < np.minimum(begun, stop) - FOUND,
        'braked': hardest > 1.1,
        'needless': needless(robot, drive),
    }


def needless(robot, drive):
    """Return which commands (N,) were first slowed although a stop was not due."""
    commands, ways, shares = drive
    found = np.zeros(len(commands), bool)
    for k, command in enumerate(commands):
        (slowed,) = np.nonzero(shares[:, k] < 1.0)
        if not len(slowed):
            continue
        fastest = np.max(np.abs(command))
        due = 1.1 * (HORIZON + 0.5 * fastest / BRAKES)
        ahead = ways[slowed[0], k] + np.linspace(0.0, due, SAMPLES)[:, None] * command
        inside = np.all(np.abs(ahead) <= BOUND)
        nearest = np.min(ks.singularity(robot, ahead).distance)
        found[k] = inside and nearest > 1.1 * robot.singularity.thresholds.stop
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--arms', default=ARMS)
    parser.add_argument('--commands', type=int, default=100, help='of each arm')
    parser.add_argument('--seconds', type=float, default=0.8, help='of each command')
    parser.add_argument('--seed', type=int, default=5)
    parser.add_argument('--worst', type=int, default=0, help='show so many of each kind')
    options = parser.parse_args()
    kinds = ('limit', 'singular', 'braked', 'needless')
    print(f'{"arm":24}{"slowed":>8}' + ''.join(f'{kind:>10}' for kind in kinds), end='')
    print(f'{"hardest":>10}{"CPU, s":>8}')
    for name in options.arms.split(','):
        begin = time.process_time()
        robot, random = limited(robot_of(name)), np.random.default_rng(options.seed)
        drive = driven(robot, *starts(robot, options.commands, random), options.seconds)
        hardest, counts = judged(robot, drive)
        slowed = np.sum(np.min(drive.shares, axis=0) < 1.0)
        numbers = ''.join(f'{np.sum(counts[kind]):10}' for kind in kinds)
        print(f'{name:24}{slowed:8}{numbers}{hardest.max():10.2f}', end='')
        print(f'{time.process_time() - begin:8.0f}', flush=True)
        for kind in kinds:
            for k in np.flatnonzero(counts[kind])[: options.worst]:
                print(f'  {kind}: {drive.ways[0, k].tolist()}, {drive.commands[k].tolist()}')


if __name__ == '__main__':
    main()
