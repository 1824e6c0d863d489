"""
Another tool and an edited robot file at 1 kHz: nothing lost, each answer wholly old or wholly new.

    python bench/reload.py [--seconds 60] [--rate 1000] [--every 1.0]

Node, feeder, listener and this process, which changes the arm, are processes of their own. Every
second the tool is changed or the file is edited and read again, in turns, and now and then the
file is bad and must be refused. Afterwards each pose, with the Jacobian, twist and manipulability
of the same message, is compared with those of every arm that there was: the library's, at the
joint positions that were sent. The gaps are those between two poses at the listener, beside those
between the same two at the feeder.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import kinematics_service as ks

ROBOT = 'ur5e'
PATIENCE = 120.0
# Room for two seconds in which the listener does not run: its own losses are not the node's.
DEPTH = 'qos_overrides./kinematics/{}.publisher.depth:=2000'
TOPICS = ('pose', 'jacobian', 'twist', 'singularity/manipulability')
ROOM = ('--ros-args', *(word for one in TOPICS for word in ('-p', DEPTH.format(one))))
# A message is k, from which its joint positions follow.
AMPLITUDES = np.array([0.9, 0.4, 0.6, 0.8, 0.5, 1.0])
CENTRE = np.array([0.3, -1.0, 1.2, -0.4, 1.1, 0.3])
FREQUENCIES = np.array([0.31, 0.47, 0.23, 0.61, 0.37, 0.53])
# The processes share some int64, then rows of doubles by message.
GO, SENT, STOP, FED, LISTENING, ANSWERED = range(6)
SLOTS = 16
# Sent and heard (s), pose, J, twist and manipulability.
WIDTHS = (1, 1, 7, 36, 6, 1)
ENDS = np.cumsum((0, *WIDTHS))
AGREE = 1e-9
TOOLS = ((), (0.05, -0.02, 0.15), (0.0, 0.1, 0.08))
TURNS = ((), (0.3, -0.2, 0.5), (0.0, 0.0, 1.2))
# Factors of the length of the upper arm.
LENGTHS = (1.0, 1.1, 0.9)
UNCERTAIN = """\
uncertainty:
  encoder_noise: 1e-5
  velocity_noise: 1e-3
  parameters: {lengths: 1e-4, angles: 1e-3}
"""


def motion(k):
    """Return joint positions and velocities of messages, (N, 6) each, at 1 kHz."""
    phase = 2 * np.pi * FREQUENCIES * (k[:, None] * 1e-3)
    return (
        CENTRE + AMPLITUDES * np.sin(phase),
        AMPLITUDES * 2 * np.pi * FREQUENCIES * np.cos(phase),
    )


def shared(path, count):
    slots = np.memmap(path, np.int64, 'r+', shape=(SLOTS,))
    rows = np.memmap(path, np.float64, 'r+', offset=8 * SLOTS, shape=(count, ENDS[-1]))
    return slots, rows


def stamp_of(k):
    return divmod((k + 1) * 1_000_000 + 1_000_000_000_000, 1_000_000_000)


def feed(path, count, rate):
    """Publish message after message at a rate until all are sent."""
    import rclpy
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState

    from kinematics_service.estimation.cdr import STAMP, STAMP_AT
    from kinematics_service.estimation.joint_state_form import form_of

    names = list(ks.load_robot(ROBOT).joint_names)
    message = JointState(name=names, position=[0.0] * 6, velocity=[0.0] * 6)
    data = bytearray(serialize_message(message))
    form = form_of(bytes(data))
    q, qdot = motion(np.arange(count))
    rclpy.init()
    node = rclpy.create_node('feeder')
    publisher = node.create_publisher(JointState, 'joint_states', 1000)
    while publisher.get_subscription_count() == 0:
        time.sleep(0.02)
    slots, rows = shared(path, count)
    slots[FED] = 1
    while not slots[GO]:
        time.sleep(0.01)
    begin = time.perf_counter()
    for k in range(count):
        late = time.perf_counter() - begin - k / rate
        if late < 0.0:
            time.sleep(-late)
        elif late > 0.02:  # it was held up itself: what it could not send is not a burst
            begin += late
        data[form.positions], data[form.velocities] = q[k].tobytes(), qdot[k].tobytes()
        STAMP.pack_into(data, STAMP_AT, *stamp_of(k))
        rows[k, 0] = time.monotonic()
        publisher.publish(bytes(data))
        slots[SENT] = k + 1
    while not slots[STOP]:
        time.sleep(0.05)


def listen(path, count):
    """Store the answers by message; those without a stamp belong to the pose before them."""
    import rclpy
    from geometry_msgs.msg import PoseStamped, TwistStamped
    from rclpy.experimental import EventsExecutor
    from rclpy.serialization import deserialize_message
    from std_msgs.msg import Float64, Float64MultiArray

    rclpy.init()
    node = rclpy.create_node('listener')
    slots, rows = shared(path, count)
    raw = {name: [] for name in ('pose', 'jacobian', 'twist', 'measure')}
    kinds = {
        'pose': ('pose', PoseStamped),
        'jacobian': ('jacobian', Float64MultiArray),
        'twist': ('twist', TwistStamped),
        'measure': ('singularity/manipulability', Float64),
    }

    def heard(name):
        store = raw[name]

        def take(data):
            store.append((time.monotonic(), data))
            slots[ANSWERED] = min(map(len, raw.values()))

        return take

    for name, (topic, kind) in kinds.items():
        node.create_subscription(kind, f'/kinematics/{topic}', heard(name), 2000, raw=True)
    while any(node.count_publishers(f'/kinematics/{topic}') == 0 for topic, _ in kinds.values()):
        time.sleep(0.02)
    slots[LISTENING] = 1
    executor = EventsExecutor()
    executor.add_node(node)
    while not slots[STOP]:
        executor.spin_once(timeout_sec=0.05)
    stamps = []
    for at, data in raw['pose']:
        message = deserialize_message(data, PoseStamped)
        stamp = message.header.stamp
        k = (stamp.sec * 1_000_000_000 + stamp.nanosec - 1_000_000_000_000) // 1_000_000 - 1
        p, o = message.pose.position, message.pose.orientation
        rows[k, 1 : ENDS[3]] = (at, p.x, p.y, p.z, o.x, o.y, o.z, o.w)
        stamps.append(k)
    for k, (_, data) in zip(stamps, raw['jacobian']):
        rows[k, ENDS[3] : ENDS[4]] = deserialize_message(data, Float64MultiArray).data
    for _, data in raw['twist']:
        message = deserialize_message(data, TwistStamped)
        stamp, v = message.header.stamp, message.twist
        k = (stamp.sec * 1_000_000_000 + stamp.nanosec - 1_000_000_000_000) // 1_000_000 - 1
        rows[k, ENDS[4] : ENDS[5]] = (
            *(v.linear.x, v.linear.y, v.linear.z),
            *(v.angular.x, v.angular.y, v.angular.z),
        )
    for k, (_, data) in zip(stamps, raw['measure']):
        rows[k, ENDS[5]] = deserialize_message(data, Float64).data
    slots[ANSWERED] = -1 if sorted(set(stamps)) != stamps else len(stamps)
    slots[LISTENING] = 2


class Changer:
    """Calls the services of the node, and notes the time of each call."""

    def __init__(self):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from rcl_interfaces.srv import SetParametersAtomically
        from std_srvs.srv import Trigger

        rclpy.init()
        self.node = rclpy.create_node('changer')
        self.executor = rclpy.executors.SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.kinds = Trigger, SetParametersAtomically
        self.reloads = self.node.create_client(Trigger, '/kinematics/reload')
        self.sets = self.node.create_client(
            SetParametersAtomically, '/kinematics/set_parameters_atomically'
        )
        self.calls = []  # what, begin, end
        self.told = {}  # by the node, of its input
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def _on_diagnostics(self, message):
        self.told = {pair.key: pair.value for pair in message.status[0].values}

    def rest(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.1)

    def ready(self):
        return self.reloads.service_is_ready() and self.sets.service_is_ready()

    def _call(self, what, client, request):
        begin = time.monotonic()
        future = client.call_async(request)
        self.executor.spin_until_future_complete(future, timeout_sec=PATIENCE)
        self.calls.append((what, begin, time.monotonic()))
        return future.result()

    def reload(self, what):
        return self._call(what, self.reloads, self.kinds[0].Request())

    def set_tool(self, xyz, rpy):
        from rclpy.parameter import Parameter

        request = self.kinds[1].Request()
        request.parameters = [
            Parameter('tool.xyz', value=list(xyz)).to_parameter_msg(),
            Parameter('tool.rpy', value=list(rpy)).to_parameter_msg(),
        ]
        return self._call('tool', self.sets, request).result


def text_with(length):
    """Return the robot file with another length of the upper arm."""
    text = ks.bundled_robots()[ROBOT].read_text(encoding='utf-8')
    assert text.count('-0.425') >= 1
    head, _, tail = text.partition('known_poses:')
    assert tail
    return head.replace('-0.425', repr(-0.425 * length))


def edit(path, text):
    new = path.with_suffix('.new')
    new.write_text(text, encoding='utf-8')
    new.replace(path)


def expected(length, tool, q, qdot):
    """Return pose, J, twist and manipulability of an arm, row by row; the sign of w is open."""
    text = text_with(length)
    robot = ks.robot_from_text(text)
    if tool:
        pose = f'{{xyz: {list(TOOLS[tool])}, rpy: {list(TURNS[tool])}}}'
        kept = [line for line in text.splitlines() if not line.startswith('tool:')]
        robot = ks.robot_from_text('\n'.join([*kept, f'tool: {pose}', '']))
    state = ks.evaluate(robot, q, qdot)
    return np.concatenate(
        [
            state.position,
            state.quaternion_xyzw,
            state.jacobian.reshape(len(q), 36),
            state.twist,
            ks.singularity(robot, q).manipulability[:, None],
        ],
        axis=1,
    )


def judge(rows, count):
    """Return which arm each answer is of, -1 for none, and how many fit several arms."""
    q, qdot = motion(np.arange(count))
    found = np.full(count, -1)
    several = 0
    heard = np.array(rows[:, ENDS[2] :])
    for v in range(len(LENGTHS) * len(TOOLS)):
        wanted = expected(LENGTHS[v // len(TOOLS)], v % len(TOOLS), q, qdot)
        along = np.sum(wanted[:, 3:7] * heard[:, 3:7], axis=1)
        wanted[:, 3:7] *= np.where(along < 0.0, -1.0, 1.0)[:, None]
        fits = np.all(np.abs(wanted - heard) <= AGREE, axis=1)
        several += int(np.sum(fits & (found >= 0)))
        found[fits] = v
    return found, several


def run(options, path, file):
    count = round(options.seconds * options.rate)
    with open(path, 'wb') as stream:
        stream.truncate(8 * SLOTS + 8 * count * int(ENDS[-1]))
    slots, rows = shared(path, count)
    rows[:] = np.nan
    edit(file, text_with(1.0))
    own = (sys.executable, __file__, '--path', path, '--count', str(count))
    node = subprocess.Popen(
        [sys.executable, '-m', 'kinematics_service', '--robot', str(file), *ROOM],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    peers = [
        subprocess.Popen([*own, '--peer', 'feed', '--rate', str(options.rate)]),
        subprocess.Popen([*own, '--peer', 'listen']),
    ]
    try:
        changer, deadline = Changer(), time.monotonic() + PATIENCE
        while not (changer.ready() and slots[FED] and slots[LISTENING]):
            if time.monotonic() > deadline or node.poll() is not None:
                raise SystemExit('not matched in time')
            time.sleep(0.05)
        time.sleep(2.0)
        refused = change_all(options, slots, changer, file, count)
        deadline = time.monotonic() + 10.0
        while slots[ANSWERED] < slots[SENT] and time.monotonic() < deadline:
            time.sleep(0.05)
        changer.rest(3.0)
        slots[STOP] = 1
        deadline = time.monotonic() + PATIENCE
        while slots[LISTENING] != 2 and time.monotonic() < deadline:
            time.sleep(0.1)
    finally:
        slots[STOP] = 1
        node.send_signal(signal.SIGTERM)
        for process in (node, *peers):
            process.wait(timeout=30)
    report(slots, rows, count, changer, refused)


def change_all(options, slots, changer, file, count):
    """Change the arm until all messages are sent; return how many bad files were refused."""
    slots[GO] = 1
    length = tool = turn = refused = 0
    while slots[SENT] < count:
        time.sleep(options.every)
        turn += 1
        if turn % 5 == 0:
            edit(file, text_with(1.0).replace('alpha: pi/2', 'alhpa: pi/2', 1))
            answer = changer.reload('bad file')
            assert not answer.success
            assert 'alhpa' in answer.message, answer.message
            refused += 1
        elif turn % 2:
            tool = (tool + 1) % len(TOOLS)
            answer = changer.set_tool(TOOLS[tool], TURNS[tool])
            assert answer.successful, answer.reason
        else:
            length = (length + 1) % len(LENGTHS)
            uncertain = turn % 4 == 0
            edit(file, text_with(LENGTHS[length]) + (UNCERTAIN if uncertain else ''))
            answer = changer.reload('file with uncertainty' if uncertain else 'file')
            assert answer.success, answer.message
    return refused


def report(slots, rows, count, changer, refused):
    sent, answered = int(slots[SENT]), int(slots[ANSWERED])
    found, several = judge(rows, count)
    changes = int(np.sum(np.diff(found) != 0))
    print(
        f'{sent} sent; the node tells of {changer.told.get("accepted")} accepted and '
        f'{changer.told.get("lost")} lost; {answered} answered, {sent - answered} not; of no arm '
        f'or of two: {int(np.sum(found < 0)) + several}; arms one after the other: {changes + 1}, '
        f'{len(set(found.tolist()))} different; {refused} bad files refused'
    )
    fed, heard = np.array(rows[:, 0]), np.array(rows[:, 1])
    age, gaps, own = heard - fed, np.diff(heard), np.diff(fed)
    busy = np.zeros(count, bool)
    print('from the feeder to the listener (ms), and the longest gap between two poses (feeder):')
    for what in ('tool', 'file', 'file with uncertainty', 'bad file'):
        spans = [
            (fed >= begin - 0.001) & (fed <= end + 0.05)
            for name, begin, end in changer.calls
            if name == what
        ]
        if not spans:
            continue
        during = np.any(spans, axis=0)
        busy |= during
        took = [end - begin for name, begin, end in changer.calls if name == what]
        print_row(f'{what}, {len(spans)} times', age, gaps, own, during, took)
    print_row('otherwise', age, gaps, own, ~busy, None)


def print_row(name, age, gaps, own, during, took):
    ages = 1e3 * age[during]
    longest = np.nanmax(np.where(during[1:], gaps, 0.0))
    fed = own[int(np.nanargmax(np.where(during[1:], gaps, 0.0)))]
    answer = f'; answer of the service {1e3 * np.median(took):.0f}' if took else ''
    print(
        f'  {name}: median {np.nanmedian(ages):.2f}, 99 % {np.nanpercentile(ages, 99):.2f}, '
        f'longest {np.nanmax(ages):.1f}; gap {1e3 * longest:.1f} ({1e3 * fed:.1f}){answer}'
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--rate', type=float, default=1000.0)
    parser.add_argument('--every', type=float, default=1.0)
    parser.add_argument('--peer', help=argparse.SUPPRESS)
    parser.add_argument('--path', help=argparse.SUPPRESS)
    parser.add_argument('--count', type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '87')
    if options.peer == 'feed':
        feed(options.path, options.count, options.rate)
    elif options.peer == 'listen':
        listen(options.path, options.count)
    else:
        with tempfile.TemporaryDirectory(prefix='reload_') as folder:
            run(options, str(Path(folder, 'shared')), Path(folder, f'{ROBOT}.yaml'))


if __name__ == '__main__':
    main()
