# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Audit recordings in this process, in several processes, or on a dask cluster."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from multiprocessing.connection import wait
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

from .....errors import KinematicsError
from .....printing import json_text
from .....robot.measures import Level
from ...readers.open_file import open_source
from ...readers.source import Selection
from ...sweep import Item, Result, results_of_workers
from ..auditing import Audit, AuditSettings, audit
from ..frames import FrameReport
from ..plan_findings import joints_refuted
from .bag_writer import open_writer
from .document import document_of
from .page import page_of
from .page_header import origin_of
from .summary import Summary, summary_of

# A callback for progress bars: it is called with the number of messages or files processed since
# its last call.
Done = Callable[[int], None]
# A function that opens a progress bar for a number of messages or files; None: number unknown.
Bar = Callable[[int | None], AbstractContextManager[Done]]


class Run(NamedTuple):
    """
    One recording to audit, and the requested results.

    Attributes
    ----------
    robot
        The robot file, or the name of a bundled robot.
    date
        Date of the audit, as text.
    failures
        Words of `--fail-on`: the kinds of findings that fail the audit. None: the option's
        default.
    html, json
        Whether the HTML page, and the JSON document, are requested.
    out
        The MCAP file to write, or None.
    """

    file: Path
    robot: str
    date: str
    reading: Selection
    settings: AuditSettings
    failures: tuple[str, ...] | None
    html: bool
    json: bool
    out: Path | None


class Outcome(NamedTuple):
    """The outputs of an audit as texts. `error` is empty if no error occurred."""

    error: str
    summary: Summary | None = None
    html: str = ''
    json: str = ''
    failed: bool = True


def outcome_of(run: Run, bar: Bar = lambda _: nullcontext(lambda _: None)) -> Outcome:
    """Run an audit and return its outcome; a faulty file gives an outcome with an error."""
    try:
        finished = _audited(run, bar)
    except KinematicsError as error:
        return Outcome(str(error))
    return Outcome(
        no_frames(finished, run.failures),
        summary_of(finished),
        page_of(finished, origin_of(run.file, run.robot, run.date)) if run.html else '',
        json_text(document_of(finished)) if run.json else '',
        failed_by(finished, run.failures),
    )


def _audited(run: Run, bar: Bar) -> Audit:
    reading = run.reading
    with ExitStack() as stack:
        source = stack.enter_context(open_source(run.file, reading))
        write = None
        if run.out is not None:
            writer = open_writer(run.out, reading.robot, reading.joint_prefix)
            write = stack.enter_context(writer).write
        progress = stack.enter_context(bar(source.total))
        return audit(source, reading.robot, str(run.file), run.settings, progress, write)


def failed_by(finished: Audit, failures: tuple[str, ...] | None) -> bool:
    """
    Return whether an audit fails, so that the command exits with code 1. `failures` has the words
    of `--fail-on`; None: the option's default.
    """
    if failures is None:
        limited = finished.plan_settings.speed_limit is not None
        usual = 'stop', 'undecided', *(['speed'] if limited else [])
        failures = usual if finished.planned else ('never',)
    worst = max((interval.level for interval in finished.intervals), default=Level.OK)
    frames = finished.frames
    plans = finished.plans.values()
    # A plan along which a loop of the arm does not close fails like a plan through a singular
    # pose, because the arm can follow neither.
    poses = [part.verdict for plan in plans for part in (plan.singularity, plan.closure) if part]
    speeds = [speed.verdict for plan in plans for speed in plan.speeds]
    near = 'refuted' in poses
    beyond = joints_refuted(finished, 'limits')
    fast = bool(joints_refuted(finished, 'speed')) or 'refuted' in speeds
    failed = {
        'never': False,
        'warn': worst >= Level.WARN or near,
        'stop': worst >= Level.ERROR or near,
        'limits': bool(beyond) or any(joint.beyond for joint in finished.joints),
        'speed': fast or any(joint.too_fast for joint in finished.joints),
        'undecided': 'not decided' in (*poses, *speeds),
        # With `frames`, fail also if no measured poses are given, or if they could not be
        # compared.
        'frames': not isinstance(frames, FrameReport) or frames.level == Level.ERROR,
    }
    # Fail on refused samples of a plan and on damaged files, because not all of their content was
    # judged.
    unjudged = finished.damaged or (finished.planned and bool(finished.refused))
    return (unjudged and failures != ('never',)) or any(failed[word] for word in failures)


def no_frames(finished: Audit, failures: tuple[str, ...] | None) -> str:
    """
    Return an error sentence if `--fail-on frames` is given without measured poses, otherwise ''.
    """
    if finished.frames is not None or 'frames' not in (failures or ()):
        return ''
    return (
        f'{finished.file}: --fail-on frames: a second source of poses is missing; name its topic '
        'with --pose-topic (bags) or its columns with --columns pose=... (tables)'
    )


def outcomes(runs: Sequence[Run], jobs: int, workers: str | None) -> Iterator[Outcome]:
    """Yield the outcome of each run, in the order of the runs."""
    if workers is None and (jobs == 1 or len(runs) == 1):
        for run in runs:
            yield outcome_of(run, shown_bar)
        return
    with shown_bar(len(runs), 'files') as progress:
        for outcome in spread(outcome_of, runs, jobs, workers):
            progress(1)
            yield outcome


def spread(
    function: Callable[[Item], Result], items: Sequence[Item], jobs: int, workers: str | None
) -> Iterator[Result]:
    """
    Yield the result of a function for each item, in order. `jobs` processes, or a dask cluster,
    compute the results.
    """
    if workers is not None:
        yield from results_of_workers(function, items, workers)
        return
    if jobs == 1:
        yield from map(function, items)
        return
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(jobs, context, _live_with_the_parent) as pool:
        try:
            yield from pool.map(function, items)
        except BaseException:
            for process in multiprocessing.active_children():
                process.terminate()
            raise


def _live_with_the_parent() -> None:
    # Ignore SIGINT, because the parent process handles it, and end this process when the parent
    # ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


@contextmanager
def shown_bar(total: int | None, noun: str = 'messages') -> Iterator[Done]:
    """Show a progress bar on standard error if it is a terminal; remove the bar at the end."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(noun, total=total)
        yield lambda count: bar.advance(task, count)
