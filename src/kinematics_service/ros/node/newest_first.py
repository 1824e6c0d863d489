"""Work in a thread of its own, of which only the newest piece waits."""

import contextlib
import threading
from collections.abc import Callable

from rclpy.exceptions import InvalidHandle


class NewestFirst:
    """
    Calls a function with the newest of what is put in; a piece that waits is replaced by the next.

    Its thread starts with the first piece.

    Parameters
    ----------
    work
        Called with a piece, and with how many pieces it has replaced; it raises nothing but
        `InvalidHandle`, which a node that ends may cause.
    """

    def __init__(self, work: Callable[[bytes, int], None]) -> None:
        self._work, self._changed = work, threading.Condition()
        self._waiting: bytes | None = None
        self._replaced = 0
        self._thread: threading.Thread | None = None
        self._is_over = False

    def put(self, piece: bytes) -> None:
        """Have a piece worked on in the place of the one that waits."""
        with self._changed:
            if self._waiting is not None:
                self._replaced += 1
            self._waiting = piece
            self._changed.notify()
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, daemon=True)
            self._thread.start()

    def close(self, longest: float) -> None:
        """End the thread; wait for its present piece at most this long (s)."""
        with self._changed:
            self._is_over = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(longest)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._is_over or self._waiting is not None)
                piece, self._waiting = self._waiting, None
                replaced, self._replaced = self._replaced, 0
            if self._is_over or piece is None:
                return
            with contextlib.suppress(InvalidHandle):
                self._work(piece, replaced)
