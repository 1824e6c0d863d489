# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Datasets written for tests, as the libraries of robot learning lay them out."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from scipy.spatial.transform import Rotation

import kinematics_service as ks

RPY = ('x', 'y', 'z', 'roll', 'pitch', 'yaw')


def fixed(numbers):
    """Return rows of numbers (N, k) as Arrow has vectors of one length, in single precision."""
    numbers = np.asarray(numbers, dtype=np.float32)
    return pa.FixedSizeListArray.from_arrays(pa.array(numbers.reshape(-1)), numbers.shape[1])


def write_lerobot(folder, episodes, names, fps=30, version='v3.0'):
    """
    Write a LeRobot dataset of single precision.

    Parameters
    ----------
    episodes
        Of each the vectors (N, k) by name.
    names
        Names of elements, by vector; what has none is left without.
    """
    (folder / 'meta').mkdir(parents=True)
    features = {
        name: {'dtype': 'float32', 'shape': [vector.shape[1]], 'names': names.get(name)}
        for name, vector in episodes[0].items()
    }
    features['timestamp'] = {'dtype': 'float32', 'shape': [1], 'names': None}
    info = {'codebase_version': version, 'fps': fps, 'features': features}
    (folder / 'meta' / 'info.json').write_text(json.dumps(info))
    chunk = folder / 'data' / 'chunk-000'
    chunk.mkdir(parents=True)
    tables = []
    for k, vectors in enumerate(episodes):
        frames = np.arange(len(next(iter(vectors.values()))))
        columns = {name: fixed(vector) for name, vector in vectors.items()}
        columns['timestamp'] = pa.array((frames / fps).astype(np.float32))
        columns['frame_index'], columns['episode_index'] = frames, np.full(len(frames), k)
        tables.append(pa.table(columns))
    if version == 'v3.0':
        parquet.write_table(pa.concat_tables(tables), chunk / 'file-000.parquet')
    else:
        for k, table in enumerate(tables):
            parquet.write_table(table, chunk / f'episode_{k:06d}.parquet')
    return folder


def swinging(robot, count, rate=30.0, seed=0, reach=0.3, noise=0.0):
    """Return positions (N, n) of a smooth motion within the limits, and those read with noise."""
    random = np.random.default_rng(seed)
    low, high = np.clip(robot.limits, -2.0, 2.0).T
    speed, phase = random.uniform(0.4, 1.2, robot.dof), random.uniform(0.0, 6.28, robot.dof)
    angle = np.arange(count)[:, None] / rate * speed + phase
    q = 0.5 * (low + high) + reach * (high - low) * np.sin(angle)
    return q, q + noise * random.normal(size=q.shape)


def pose_numbers(poses, kind='xyz'):
    """Return places and orientations of poses (N, 4, 4): angles by scipy's word, or another."""
    rotations = Rotation.from_matrix(poses[:, :3, :3])
    numbers = {
        'rotvec': rotations.as_rotvec,
        'xyzw': rotations.as_quat,
        'wxyz': lambda: np.roll(rotations.as_quat(), 1, axis=1),
    }.get(kind, lambda: rotations.as_euler(kind))()
    return np.column_stack([poses[:, :3, 3], numbers])


def poses_of(robot, q):
    """Return the poses (N, 4, 4) of a robot."""
    return ks.forward_kinematics(robot, q)
