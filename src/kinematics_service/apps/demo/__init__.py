# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""
Run the node without a robot (`demo`), and show the messages of a node on a terminal (`echo`).

`demo` starts a node, a simulated arm that publishes joint states, and a listener (`demo.py`,
`virtual_arm.py`, `demo_listener.py`). The motion of the arm is in `motions/`. A live table or
plain lines show the received messages. `echo` subscribes to a node that already runs.
"""
