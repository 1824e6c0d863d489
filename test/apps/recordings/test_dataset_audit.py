# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""`audit` of a dataset: one table and one page, labels, and `ks.judge_table`."""

import json

import linkages
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
from arms import robot_of
from audits import run
from datasets import RPY, fixed, pose_numbers, poses_of, swinging, write_lerobot
from refusal import refused

import kinematics_service as ks
from kinematics_service.apps.recordings.audit.dataset.labels import labels_of
from kinematics_service.errors import LoopError, RecordingError

ROBOT = robot_of('so101')
NAMES = {
    'observation.state': [*(f'{name}.pos' for name in ROBOT.joint_names), 'gripper.pos'],
    'observation.ee_pose': list(RPY),
}
LENGTHS = (60, 45, 50)
Q = swinging(ROBOT, sum(LENGTHS), seed=11)[0]


def episodes(change=lambda k, q, poses: (q, poses)):
    """Return the vectors of three episodes, each changed by its number."""
    ends = np.cumsum([0, *LENGTHS])
    made = []
    for k, (begin, end) in enumerate(zip(ends, ends[1:])):
        q, poses = change(k, Q[begin:end], poses_of(ROBOT, Q[begin:end]))
        state = np.column_stack([q, np.zeros(len(q))])
        made.append({'observation.state': state, 'observation.ee_pose': pose_numbers(poses)})
    return made


@pytest.fixture
def dataset(tmp_path):
    """Return a dataset with a fault in its second episode alone."""

    def change(k, q, poses):
        return (q, np.linalg.inv(poses)) if k == 1 else (q, poses)

    return write_lerobot(tmp_path / 'set', episodes(change), NAMES, version='v2.1')


def test_one_table_and_one_page_for_all_worst_first(dataset, tmp_path, capsys):
    page, told = tmp_path / 'page.html', tmp_path / 'told.json'
    code, out, _ = run(
        capsys, dataset, '--robot', 'so101', '--html', page, '--json', told, '--fail-on', 'frames'
    )
    assert code == 1
    assert f'{dataset}: 3 episodes, 155 frames' in out
    assert 'ERROR  1 of 3: ' in out
    assert 'The poses are those of the base in the tool frame' in out
    document = json.loads(told.read_text())
    assert [one['level'] for one in document['episodes']] == ['ERROR', 'OK', 'OK']
    assert [one['failed'] for one in document['episodes']] == [True, False, False]
    assert document['episodes'][0]['name'].endswith('episode_000001.parquet:1')
    assert document['found'][0]['episodes'] == 1
    html = page.read_text()
    assert html.index('episode_000001') < html.index('episode_000000')
    assert run(capsys, dataset, '--robot', 'so101')[0] == 0


def test_of_many_that_disagree_some_are_asked_for_the_cause(tmp_path, capsys, monkeypatch):
    run_of = 'kinematics_service.apps.recordings.audit.dataset.dataset_run'
    made = episodes(lambda k, q, poses: (q, np.linalg.inv(poses)))
    folder = write_lerobot(tmp_path / 'set', made, NAMES)
    for name, value in (('LARGE_DATASET', 2), ('SEARCHED_OF_BATCH', 1), ('SEARCHED_EPISODES', 1)):
        monkeypatch.setattr(f'{run_of}.{name}', value)
    _, out, _ = run(capsys, folder, '--robot', 'so101', '--json', '-')
    found = [str(one['findings']) for one in json.loads(out)['episodes']]
    assert sum('base in the tool frame' in text for text in found) == 1
    assert all('apart (rms)' in text or 'base in the tool' in text for text in found)


def test_a_damaged_file_costs_that_file(dataset, tmp_path, capsys):
    file = dataset / 'data' / 'chunk-000' / 'episode_000000.parquet'
    file.write_bytes(file.read_bytes()[:200])
    code, out, _ = run(capsys, dataset, '--robot', 'so101', '--json', '-')
    found = json.loads(out)['episodes']
    assert code == 1
    assert [one['code'] for one in found] == ['unreadable', '', '']
    assert found[0]['error'].startswith(f'{file}: ')
    assert [one['frames'] for one in found] == [0, 45, 50]


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (['--out', 'a.mcap'], 'leave out --out'),
        (['--scale'], '--scale'),
        (['other.csv'], 'one dataset'),
        (['--html', '.'], '--html: . is a folder'),
    ],
)
def test_what_is_for_recordings_is_refused(tmp_path, capsys, words, told):
    np.savez(tmp_path / 'set.npz', q=Q)
    code, _, err = run(capsys, tmp_path / 'set.npz', '--robot', 'so101', *words)
    assert code == 2
    assert told in ' '.join(err.split())


def test_what_is_for_datasets_is_refused(tmp_path, capsys):
    (tmp_path / 'run.csv').write_text('stamp\n')
    code, _, err = run(capsys, tmp_path / 'run.csv', '--robot', 'so101', '--labels', 'x')
    assert code == 2
    assert '--labels is for datasets' in ' '.join(err.split())
    assert 'run.csv' in err


def test_labels_stand_beside_the_data(dataset, tmp_path, capsys):
    folder = tmp_path / 'labels'
    run(capsys, dataset, '--robot', 'so101', '--labels', folder, '--clearance')
    files = sorted(folder.rglob('*.parquet'))
    assert [file.relative_to(folder).as_posix() for file in files] == [
        f'data/chunk-000/episode_{k:06d}/{k}.parquet' for k in range(3)
    ]
    table = parquet.read_table(files[0])
    q = np.float32(Q[:60]).astype(float)
    known = ks.singularity(ROBOT, q)
    assert table['row'].to_pylist() == list(range(60))
    np.testing.assert_allclose(table['distance'], known.distance, rtol=0.05)  # it is tracked
    assert np.array_equal(table['manipulability'], known.manipulability)
    assert np.array_equal(table['clearance'], known.clearance)
    assert np.array_equal(np.array(table['lost_direction'].to_pylist()), known.lost_direction)


def batch_of(q, column='q'):
    return pa.record_batch({column: fixed(q), 'reward': np.zeros(len(q))})


def test_judge_table_adds_labels_and_keeps_the_rest():
    q = np.float32(Q[:20]).astype(float)
    judged = ks.judge_table(batch_of(q), ROBOT)
    assert isinstance(judged, pa.RecordBatch)
    assert judged.schema.names[:2] == ['q', 'reward']
    known = ks.singularity(ROBOT, q).distance
    np.testing.assert_allclose(judged['distance'], known, rtol=0.05)  # it is tracked
    table = pa.Table.from_batches([batch_of(q)])
    assert ks.judge_table(table, 'so101', clearance=True).column_names[-1] == 'clearance'
    with refused(RecordingError, 'duplicate-name', "'distance'"):
        ks.judge_table(judged, ROBOT)


def test_rows_that_are_no_pose_have_no_labels(tmp_path):
    q = np.array(Q[:5])
    q[2, 1] = np.nan
    judged = ks.judge_table(pa.Table.from_batches([batch_of(q)]), ROBOT)
    # Neither written nor read by most versions of pyarrow as lists of fixed size.
    labels = judged.drop_columns('q')
    parquet.write_table(labels, tmp_path / 'labels.parquet')
    assert parquet.read_table(tmp_path / 'labels.parquet').equals(labels)
    known = ks.singularity(ROBOT, np.float32(Q[:2]).astype(float)).lost_direction
    assert np.array_equal(judged['lost_direction'].to_pylist()[:2], known)
    for name in ('distance', 'branch', 'lost_direction'):
        assert [one is None for one in judged[name].to_pylist()] == [k == 2 for k in range(5)]


def test_rows_at_which_a_loop_does_not_close_have_no_labels(tmp_path):
    (tmp_path / 'short.yaml').write_text(linkages.SHORT_FIVE_BAR)
    robot = ks.load_robot(tmp_path / 'short.yaml')
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (60, robot.dof))
    closes = []
    for row in q:
        try:
            ks.forward_kinematics(robot, row)
            closes.append(True)
        except LoopError:
            closes.append(False)
    assert 5 < sum(closes) < 55
    distance = labels_of(robot, q)['distance']
    assert distance.is_valid().to_pylist() == closes
    first = closes.index(True)
    expected = ks.singularity(robot, q[[first]]).distance[0]
    assert distance[first].as_py() == expected


def test_branches_are_the_signs_of_the_factors():
    labels = labels_of(ROBOT, np.array([[0, 0, 0.9, 0, 0], [0, 0, -1.5, 0, 0.0]]))
    assert len(set(labels['branch'].tolist())) == 2
    ur = robot_of('ur5e')
    q = np.array([0.3, -1.2, 1.4, -1.6, -1.2, 0.0])
    flips = [q, q * [1, 1, 1, 1, -1, 1], q * [1, 1, -1, 1, 1, 1]]
    assert len(set(labels_of(ur, np.array(flips))['branch'].tolist())) == 3


def test_judge_table_of_other_units_and_of_two_arms():
    q = np.degrees(Q[:6])
    plain = ks.judge_table(batch_of(np.float32(Q[:6])), ROBOT)['distance'].to_pylist()
    turned = ks.judge_table(batch_of(q), ROBOT, joint_format='deg')['distance'].to_pylist()
    assert turned == pytest.approx(plain, abs=1e-5)
    pair = ks.judge_table(batch_of(np.column_stack([Q[:6], Q[6:12]])), ROBOT)
    assert {'left.distance', 'right.branch'} <= set(pair.schema.names)
    with refused(RecordingError, 'ambiguous', '--columns position=q[0:5]'):
        ks.judge_table(batch_of(np.ones((3, 9))), ROBOT)


def test_an_empty_batch_has_the_labels_too():
    judged = ks.judge_table(batch_of(Q[:3]).slice(0, 0), ROBOT)
    assert judged.num_rows == 0
    assert judged.schema == ks.judge_table(batch_of(Q[:3]), ROBOT).schema


def test_a_gate_with_nothing_to_judge_says_so(tmp_path, capsys):
    vectors = [{'observation.state': one['observation.state']} for one in episodes()]
    folder = write_lerobot(tmp_path / 'set', vectors, NAMES)
    code, out, _ = run(capsys, folder, '--robot', 'so101', '--fail-on', 'frames')
    assert code == 1
    assert '--fail-on frames: ' in out
    assert run(capsys, folder, '--robot', 'so101')[0] == 0


def test_numbers_that_are_no_radians_are_asked_for(tmp_path, capsys):
    percent = [{'observation.state': 90.0 * one['observation.state']} for one in episodes()]
    folder = write_lerobot(tmp_path / 'set', percent, NAMES)
    _, out, _ = run(capsys, folder, '--robot', 'so101')
    assert '3 of 3: The joints are no radians' in out
    assert '--joint-format deg, percent' in out
    # What was taken for what, and then the cause before what it does to the motion.
    lines = out.splitlines()[2:4]
    assert lines[0].startswith('observation.state is taken for')
    assert 'no radians' in lines[1]
    assert 'no radians' not in run(capsys, folder, '--robot', 'so101', '--joint-format', 'deg')[1]


@pytest.fixture(scope='module')
def cluster():
    distributed = pytest.importorskip('distributed', reason='needs dask[distributed]')
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address='127.0.0.1:0', host='127.0.0.1'
    ) as local:
        yield local.scheduler_address


def test_a_cluster_says_the_same(dataset, cluster, capsys):
    from distributed import Client

    words = [dataset, '--robot', 'so101', '--json', '-']
    workers = cluster.replace('tcp://', 'dask://')
    assert run(capsys, *words, '--workers', workers)[1] == run(capsys, *words)[1]
    batches = [batch_of(Q[k : k + 30]) for k in range(0, 90, 30)]
    with Client(cluster, set_as_default=False) as client:
        found = client.gather(client.map(ks.judge_table, batches, robot=ROBOT))
    assert found == [ks.judge_table(one, ROBOT) for one in batches]


def test_ray_calls_it_on_batches():
    ray = pytest.importorskip('ray', reason='needs ray')
    batches = [batch_of(Q[k : k + 30]) for k in range(0, 90, 30)]
    ray.init(num_cpus=2, include_dashboard=False, _node_ip_address='127.0.0.1')
    try:
        judge = ray.remote(ks.judge_table)
        found = ray.get([judge.remote(one, 'so101') for one in batches])
    finally:
        ray.shutdown()
    assert found == [ks.judge_table(one, 'so101') for one in batches]
