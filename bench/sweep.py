"""
A sweep of distances to singularity here and on a dask cluster of worker processes: time, equality.

    python bench/sweep.py [--robot ur5e] [--poses 1000000] [--workers 2]

The cluster is a local one, on the loopback: what it shows is what sending costs; with the cores of
other machines the rest divides. Each worker runs one thread, as the kernel does.
"""

import argparse
import time

import numpy as np

import kinematics_service as ks
from kinematics_service.display.plots.distance_map import singular_table
from kinematics_service.display.plots.ranges import random_positions
from kinematics_service.kinematics.sweep import map_batches


def seconds(function):
    """Return a result and how long it took."""
    begin = time.perf_counter()
    result = function()
    return result, time.perf_counter() - begin


def main():
    """Print a table: where, seconds, poses a second, whether every bit is the same."""
    from distributed import LocalCluster

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--poses', type=int, default=1_000_000)
    parser.add_argument('--workers', type=int, default=2)
    given = parser.parse_args()
    robot = ks.load_robot(given.robot)
    q = random_positions(robot, np.random.default_rng(0), given.poses)
    singular_table(robot, q[:1])  # imported before any clock runs
    print(f'{given.robot}, {given.poses:,} poses')
    print(f'{"where":28} {"s":>7} {"poses/s":>11}  equal')
    here, took = seconds(lambda: map_batches(singular_table, robot, q))
    print(f'{"this process":28} {took:7.2f} {given.poses / took:11,.0f}', flush=True)
    with LocalCluster(
        n_workers=given.workers,
        threads_per_worker=1,
        dashboard_address='127.0.0.1:0',
        host='127.0.0.1',
    ) as cluster:
        address = cluster.scheduler_address.replace('tcp://', 'dask://')
        for run in ('first', 'second'):
            there, took = seconds(lambda: map_batches(singular_table, robot, q, address))
            name = f'{given.workers} workers, {run} run'
            same = here.tobytes() == there.tobytes()
            print(f'{name:28} {took:7.2f} {given.poses / took:11,.0f}  {same}', flush=True)


if __name__ == '__main__':
    main()
