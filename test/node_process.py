# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""The node as a process of its own, and what a process has used."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

# Long beside a turn that another process has on a core (s).
COMPUTED = 0.1


class NodeProcess:
    """`python -m kinematics_service` as a process; its standard error is read as it comes."""

    def __init__(
        self,
        *arguments: str,
        ready: bool = True,
        environment: Mapping[str, str] | None = None,
        command: Sequence[str] = ('-m', 'kinematics_service'),
    ) -> None:
        self.lines: list[str] = []
        self._ready = threading.Event()
        self.popen = subprocess.Popen(
            [sys.executable, *command, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors='replace',
            env={**os.environ, **(environment or {})},
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        if ready:
            self.wait_until_ready()

    def _read(self) -> None:
        for line in self.popen.stderr or ():
            self.lines.append(line.rstrip('\n'))
            if 'listening to' in line:
                self._ready.set()
        self._ready.set()

    def wait_until_ready(self) -> None:
        """Return when the node listens; fail where it ends instead."""
        if not self._ready.wait(30.0) or not any('listening to' in line for line in self.lines):
            self.kill()
            pytest.fail('the node did not start: ' + ' | '.join(self.lines))

    def wait(self, seconds: float = 30.0) -> int:
        """Return the exit code of a process that ends by itself."""
        code = self.popen.wait(seconds)
        self._reader.join(seconds)
        return code

    @property
    def stderr(self) -> str:
        """Return what was written to standard error so far."""
        return '\n'.join(self.lines)

    def kill(self) -> None:
        """End the process if it still runs."""
        if self.popen.poll() is None:
            self.popen.kill()
        self.popen.wait()
        self._reader.join(5.0)


def slowdown() -> float:
    """Return how many times its processor time a computation takes: others have the rest."""
    begin, used = time.monotonic(), time.process_time()
    while time.process_time() - used < COMPUTED:
        pass
    return (time.monotonic() - begin) / COMPUTED


def processor_seconds(pid: int) -> float:
    """Return what a process has used; on a busy machine it says how far one has come."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf('SC_CLK_TCK')


def memory(pid: int) -> float:
    """Return the resident set of a process in MiB."""
    pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 2**20
