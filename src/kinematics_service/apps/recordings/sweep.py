# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Apply a function to many items, such as recordings, on the workers of a dask cluster.

A robot is sent to a worker together with the constants computed from its robot file. So the
results of workers are equal, bit by bit, to those of this process.
"""

import logging
import re
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from ...errors import KinematicsError, SweepError

Item = TypeVar('Item')
Result = TypeVar('Result')

# Number of submitted items that wait or run for each thread of the cluster, so that no thread is
# idle.
BATCHES_PER_THREAD = 3
# Longest time to wait for the scheduler's answer, and for the first worker, s.
CONNECT_TIMEOUT = 5
ADDRESS = re.compile(r'dask://(\[[0-9a-fA-F:]+\]|[\w.-]+):(\d{1,5})/?')
INSTALL = "pip install '.[dask]' in its checkout, or pip install 'dask[distributed]'"


def cluster_address(workers: str) -> str:
    """
    Convert the address `dask://HOST:PORT` of a scheduler to the form that dask uses,
    `tcp://HOST:PORT`.

    Raises
    ------
    SweepError
        The text is not of the form `dask://HOST:PORT`.
    """
    match = ADDRESS.fullmatch(workers)
    if not match or not 0 < int(match[2]) < 65536:
        message = f'workers {workers!r} is not an address; give the scheduler as dask://HOST:PORT'
        raise SweepError(message, code='syntax')
    return f'tcp://{match[1]}:{match[2]}'


def results_of_workers(
    function: Callable[[Item], Result], items: Iterable[Item], workers: str
) -> Iterator[Result]:
    """
    Yield the result of a function for each item, in order, computed by the workers of a cluster.

    Parameters
    ----------
    function
        The function to apply, or a `functools.partial` of it. Workers import the function by its
        name, so it must be in a module that the workers have.
    items
        The arguments of the calls. Each item is read when a worker becomes free.
    workers
        `dask://HOST:PORT` of a scheduler whose workers have this package in the same version.

    Raises
    ------
    SweepError
        dask is not installed, no scheduler or worker is found, or the workers cannot run the
        function.
    """
    # Submit a further item only after the result of an earlier one, so that the memory does not
    # grow with the number of items.
    with _client(workers) as client:
        threads = sum(client.nthreads().values())
        under_way: deque[Any] = deque()
        try:
            for item in items:
                under_way.append(client.submit(function, item, pure=False))
                if len(under_way) >= BATCHES_PER_THREAD * threads:
                    yield _result(under_way.popleft())
            while under_way:
                yield _result(under_way.popleft())
        finally:
            client.cancel(list(under_way))


def _result(future: Any) -> Any:
    try:
        return future.result()
    except KinematicsError:
        raise
    except Exception as error:
        reason = ' '.join(f'{type(error).__name__}: {error}'.split())[:300]
        raise SweepError(
            'a worker failed; scheduler and workers need kinematics_service in the version of '
            f'this process ({reason})',
            code='worker-failed',
        ) from None


@contextmanager
def _client(workers: str) -> Iterator[Any]:
    address = cluster_address(workers)
    try:
        from distributed import Client  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        message = f'workers {workers} need dask ({error}): {INSTALL}'
        raise SweepError(message, code='missing-package') from None
    connect: Any = Client
    # Switch off the log of dask, because it prints whole pages. A failure is reported in one
    # sentence instead.
    logging.getLogger('distributed').setLevel(logging.CRITICAL)
    try:
        client = connect(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, TimeoutError):
        message = f'workers {workers}: no dask scheduler answers; start one (dask scheduler)'
        raise SweepError(message, code='no-answer') from None
    try:
        try:
            client.wait_for_workers(1, timeout=CONNECT_TIMEOUT)
        except TimeoutError:
            message = f'workers {workers}: the scheduler has no worker; start one with dask worker'
            raise SweepError(message, code='no-worker') from None
        yield client
    finally:
        client.close(timeout=CONNECT_TIMEOUT)
