"""
What a node costs that hears nothing, beside a bare rclpy node: processor time and wake-ups.

    python bench/idle.py [--robot ur5e] [--seconds 60] [--rounds 3] [--threads]

All nodes run at the same time, each in a ROS domain of its own, so that none hears another. The
bare node (plain_node.py --bytes) turns the same executor and comes back from it ten times a
second. With --threads each thread has a line.
"""

import argparse
import os
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path

BARE = (sys.executable, str(Path(__file__).with_name('plain_node.py')), '--bytes', '--topics')
NODE = (sys.executable, '-m', 'kinematics_service', '--robot')
WARM_UP = 10.0  # s, for imports and discovery


def threads_of(pid):
    """Return the processor time (ns) and the wake-ups of each thread of a process."""
    found = {}
    for task in Path(f'/proc/{pid}/task').iterdir():
        name = (task / 'comm').read_text().strip()
        spent = int((task / 'schedstat').read_text().split()[0])
        status = (task / 'status').read_text()
        woken = int(status.partition('\nvoluntary_ctxt_switches:')[2].split()[0])
        found[int(task.name), name] = spent, woken
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--robot', default='ur5e')
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--threads', action='store_true')
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    domain = int(os.environ.get('ROS_DOMAIN_ID', '90'))
    commands = {
        'bare node': [*BARE, 'pose'],
        'kinematics': [*NODE, arguments.robot],
    }
    processes = {
        name: subprocess.Popen(
            command,
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain + k)},
            stderr=subprocess.DEVNULL,
        )
        for k, (name, command) in enumerate(commands.items())
    }
    shares = {name: [] for name in processes}
    try:
        time.sleep(WARM_UP)
        for _ in range(arguments.rounds):
            before = {name: threads_of(process.pid) for name, process in processes.items()}
            time.sleep(arguments.seconds)
            for name, process in processes.items():
                after = threads_of(process.pid)
                spent = {
                    thread: [now - then for now, then in zip(after[thread], before[name][thread])]
                    for thread in after.keys() & before[name].keys()
                }
                cpu = sum(ns for ns, _ in spent.values()) / (arguments.seconds * 1e9)
                woken = sum(times for _, times in spent.values()) / arguments.seconds
                shares[name].append(cpu)
                print(f'{name:12}{cpu:8.3%}{woken:7.1f} wake-ups a second, {len(after)} threads')
                for thread, (ns, times) in sorted(spent.items()) if arguments.threads else ():
                    print(
                        f'    {thread[1]:18}{ns / (arguments.seconds * 1e9):8.3%}'
                        f'{times / arguments.seconds:7.1f}'
                    )
                sys.stdout.flush()
    finally:
        for process in processes.values():
            process.send_signal(signal.SIGINT)
        for process in processes.values():
            process.wait(timeout=20)
    for name, values in shares.items():
        print(
            f'{name}: {statistics.median(values):.3%} of a core '
            f'({min(values):.3%} to {max(values):.3%})'
        )


if __name__ == '__main__':
    main()
