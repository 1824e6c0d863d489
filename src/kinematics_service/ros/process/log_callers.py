"""Who writes a line to the log, found without asking the file system."""

import inspect
import sys


def know_callers() -> None:
    """
    Tell `inspect` which file each loaded module came from.

    rclpy asks it for the caller of every line of the log. At the first line `inspect` resolves the
    paths of all modules, some 600: 40 ms of processor time, where this takes less than one.
    """
    # Not documented: where it is not there, the first line costs what it costs.
    known: dict[str, str] = getattr(inspect, 'modulesbyfile', {})
    for name, module in sys.modules.copy().items():
        if file := getattr(module, '__file__', None):
            known.setdefault(file, name)
