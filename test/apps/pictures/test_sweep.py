# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""A function over many poses in batches: here, and by the worker processes of a dask cluster."""

import pickle
import time
from functools import partial

import numpy as np
import pytest
from arms import robot_of
from refusal import refused

import kinematics_service as ks
from kinematics_service.__main__ import main
from kinematics_service.apps.pictures.plots.batches import map_batches
from kinematics_service.apps.pictures.plots.distance_map import singular_table
from kinematics_service.apps.pictures.plots.plane import plane_of
from kinematics_service.apps.pictures.plots.ranges import random_positions
from kinematics_service.apps.pictures.plots.workspace import section_rows
from kinematics_service.apps.recordings import sweep
from kinematics_service.apps.recordings.sweep import cluster_address
from kinematics_service.errors import SweepError

NOBODY = 'dask://127.0.0.1:9'  # the port of "discard", where no scheduler listens


def positions(robot, count):
    return random_positions(robot, np.random.default_rng(5), count)


def doubled(robot, rows):
    return 2.0 * rows


@pytest.fixture(scope='module')
def cluster():
    distributed = pytest.importorskip('distributed', reason='needs dask[distributed]')
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=False,
        protocol='tcp://',
        dashboard_address='127.0.0.1:0',
        host='127.0.0.1',
    ) as local:
        yield local.scheduler_address.replace('tcp://', 'dask://')


@pytest.mark.parametrize('rows', [1, 7, 99, 100, 101])
def test_batches_change_no_bit(rows):
    robot = ks.load_robot('puma560')
    q = positions(robot, 100)
    whole = singular_table(robot, q)
    assert map_batches(singular_table, robot, q, rows=rows).tobytes() == whole.tobytes()


def test_nothing_in_nothing_out():
    robot = ks.load_robot('planar_2r')
    assert map_batches(singular_table, robot, np.empty((0, 2))).shape == (0, 3)


@pytest.mark.slow
@pytest.mark.parametrize(
    'name', ['planar_2r', 'parallelogram_left', 'scara_hsr065', 'puma560', 'panda']
)
def test_a_robot_that_travels_is_the_same_to_the_last_bit(name):
    robot = robot_of(name)
    q = positions(robot, 50)
    arrived = pickle.loads(pickle.dumps(robot))
    assert singular_table(arrived, q).tobytes() == singular_table(robot, q).tobytes()


@pytest.mark.slow
def test_two_workers_give_the_same_bits_as_this_process(cluster):
    robot = ks.load_robot('ur5e')
    q = positions(robot, 200)
    here = map_batches(singular_table, robot, q, rows=25)
    assert map_batches(singular_table, robot, q, cluster, rows=25).tobytes() == here.tobytes()
    cut = partial(section_rows, plane=plane_of(robot, 'xz'))
    there = map_batches(cut, robot, q[:100], cluster, rows=30)
    assert there.tobytes() == map_batches(cut, robot, q[:100]).tobytes()


def port_of_worker(robot, rows):
    """Return the port of the worker that computes, for each row, after time for the other one."""
    from distributed import get_worker

    time.sleep(0.02)
    return np.full((len(rows), 1), float(get_worker().address.rpartition(':')[2]))


def test_both_workers_work(cluster):
    robot = ks.load_robot('planar_2r')
    ports = map_batches(port_of_worker, robot, positions(robot, 40), cluster, rows=2)
    assert len(np.unique(ports)) == 2


def test_what_the_library_refuses_on_a_worker_is_refused_here(cluster):
    robot = ks.load_robot('planar_2r')
    with pytest.raises(ks.JointVectorError, match='finite'):
        map_batches(singular_table, robot, np.full((10, 2), np.nan), cluster)


def test_a_worker_that_fails_is_named_in_one_sentence(cluster):
    robot = ks.load_robot('planar_2r')
    with refused(SweepError, 'worker-failed', 'IndexError') as raised:
        map_batches(singular_table, robot, np.zeros((3, 2, 2, 2)), cluster)
    assert '\n' not in str(raised.value)


def test_a_map_by_workers_is_the_same_picture(cluster, tmp_path, capsys):
    pytest.importorskip('matplotlib')
    files = [tmp_path / 'here.png', tmp_path / 'there.png']
    for file, where in zip(files, ([], ['--workers', cluster])):
        command = ['plot', 'craig_3r', 'map', '--points', '16', '--save', str(file), *where]
        assert main(command) == 0, capsys.readouterr().err
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_an_error(monkeypatch):
    assert sweep.CONNECT_TIMEOUT <= 5
    monkeypatch.setattr(sweep, 'CONNECT_TIMEOUT', 1)
    pytest.importorskip('distributed', reason='needs dask[distributed]')
    with refused(SweepError, 'no-answer', NOBODY):
        map_batches(doubled, ks.load_robot('planar_2r'), np.zeros((1, 2)), NOBODY)


@pytest.mark.slow
def test_a_scheduler_without_workers_is_an_error(monkeypatch):
    monkeypatch.setattr(sweep, 'CONNECT_TIMEOUT', 1)
    distributed = pytest.importorskip('distributed', reason='needs dask[distributed]')
    with distributed.LocalCluster(
        n_workers=0, dashboard_address='127.0.0.1:0', host='127.0.0.1'
    ) as local:
        address = local.scheduler_address.replace('tcp://', 'dask://')
        with refused(SweepError, 'no-worker', address):
            map_batches(doubled, ks.load_robot('planar_2r'), np.zeros((1, 2)), address)


def test_without_dask_the_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__('sys').modules, 'distributed', None)
    with refused(SweepError, 'missing-package', NOBODY, "pip install '.[dask]'"):
        map_batches(doubled, ks.load_robot('planar_2r'), np.zeros((1, 2)), NOBODY)


@pytest.mark.parametrize(
    ('workers', 'address'),
    [
        ('dask://host-1.example:8786', 'tcp://host-1.example:8786'),
        ('dask://127.0.0.1:1/', 'tcp://127.0.0.1:1'),
        ('dask://[::1]:8786', 'tcp://[::1]:8786'),
    ],
)
def test_addresses(workers, address):
    assert cluster_address(workers) == address


@pytest.mark.parametrize(
    'workers',
    ['', '4', 'host:8786', 'tcp://host:8786', 'dask://host', 'dask://h:0', 'dask://h:65536'],
)
def test_what_is_no_address_is_refused_with_its_form(workers):
    with refused(SweepError, 'syntax', repr(workers), 'dask://HOST:PORT'):
        cluster_address(workers)
