"""
The node at work without a robot, and its output on a terminal: `demo`, `echo`.

`demo` starts a node, a simulated arm that feeds it joint states, and a listener (`demo.py`,
`virtual_arm.py`, `demo_listener.py`), with a motion of `motions/`; a table on the screen or plain
lines show what the listener receives. `echo` listens to a node that runs already.
"""
