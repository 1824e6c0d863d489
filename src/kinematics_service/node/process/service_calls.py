# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Call a service of another node, and repeat the call if no response arrives."""

import time
from typing import Any

from rclpy.executors import Executor
from rclpy.node import Node

# Largest number of calls until a service responds.
MAX_CALLS = 5
# Longest wait for the answer to one call (s).
CALL_TIMEOUT = 1.0


def call_service(
    node: Node,
    executor: Executor,
    kind: Any,
    service: str,
    request: Any,
    deadline: float,
    longest: float = CALL_TIMEOUT,
) -> Any:
    """
    Call a service and return its response; None if the service is missing at `deadline` or does
    not answer.

    A response is lost if the server has not yet discovered the client. So the call is repeated if
    no answer arrives within `longest` (s), up to `MAX_CALLS` times.
    """
    client = node.create_client(kind, service)
    try:
        while not client.service_is_ready():
            if time.monotonic() > deadline:
                return None
            executor.spin_once(timeout_sec=0.05)
        for _ in range(MAX_CALLS):
            future = client.call_async(request)
            end = time.monotonic() + longest
            while not future.done() and time.monotonic() < end:
                executor.spin_once(timeout_sec=0.05)
            if future.done():
                return future.result()
            client.remove_pending_request(future)
        return None
    finally:
        node.destroy_client(client)
