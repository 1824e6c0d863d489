"""A dataset audited by one or several processes; what is done is kept in a file to go on from."""

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from .....errors import RecordingError
from .....robot.measures import Level
from ...datasets.episodes import Episode, episodes_of
from ..findings import Finding
from ..report.audit_runs import shown_bar, spread
from .episode_audit import EpisodeBatch, EpisodeRow, EpisodeWork, rows_of_batch

# Frames, and episodes, of a batch: some seconds of one process.
MOST_FRAMES, MOST_EPISODES = 2**16, 64
# About so many episodes are asked for the cause of a remainder that gives no warning: a mistake
# that small is one of the whole dataset, and the search takes longer than all else.
SOUGHT = 200
# Of more episodes than this, so many of a batch at most are asked for the cause where they
# disagree: what is wrong in most of them is the same, and is named in these.
MANY, SOUGHT_OF_MANY = 2000, 2
# Of the file of what is done.
BEGINNING = '{"asked": '


class Journal:
    """
    The file of what is done: a line for what was asked, and one for each episode.

    Parameters
    ----------
    asked
        What was asked, in words: with other words nothing of the file holds.

    Raises
    ------
    RecordingError
        It is another file, or of other words.
    """

    def __init__(self, file: Path, asked: str) -> None:
        self.done: dict[str, list[EpisodeRow]] = {}
        self._file, self._asked = file, asked
        try:
            text = file.read_text(encoding='utf-8') if file.exists() else ''
        except (OSError, UnicodeDecodeError) as error:
            raise RecordingError(f'--resume: {file}: cannot be read: {error}') from None
        # A line that was not written to its end is not there, and gives way to the next one.
        whole = text[: text.rfind('\n') + 1]
        self._end = len(whole.encode())
        lines = whole.splitlines()
        try:
            if text and not lines and not text.startswith(BEGINNING):
                raise ValueError  # a file of another kind is not written over
            begun = json.loads(lines[0])['asked'] if lines else asked
            for line in lines[1:]:
                key, rows = json.loads(line)
                self.done[key] = [_row(one) for one in rows]
        except (ValueError, TypeError, KeyError):
            raise RecordingError(f'--resume: {file}: is no file of a dataset audit') from None
        if begun != asked:
            raise RecordingError(
                f'--resume: {file}: was begun with other options, another robot or dataset'
            )

    def add(self, done: Sequence[tuple[str, list[EpisodeRow]]]) -> None:
        """
        Write the rows of episodes.

        Raises
        ------
        RecordingError
            The file cannot be written.
        """
        lines = [] if self._end else [{'asked': self._asked}]
        told = [(key, [row._asdict() for row in rows]) for key, rows in done]
        text = ''.join(f'{json.dumps(one)}\n' for one in (*lines, *told))
        try:
            self._file.touch()
            with self._file.open('r+b') as stream:
                stream.truncate(self._end)
                stream.seek(self._end)
                self._end += stream.write(text.encode())
        except OSError as error:
            raise RecordingError(
                f'--resume: {self._file}: cannot be written: {error.strerror}'
            ) from None


def _row(fields: dict[str, Any]) -> EpisodeRow:
    findings = tuple(Finding(Level(level), str(text)) for level, text in fields['findings'])
    return EpisodeRow(**{**fields, 'findings': findings})


def rows_of_dataset(
    path: Path, work: EpisodeWork, jobs: int, workers: str | None, journal: Journal | None
) -> list[EpisodeRow]:
    """
    Return the rows of all episodes, in their order.

    Parameters
    ----------
    journal
        What is done already, and where the rest is written; None: nowhere.

    Raises
    ------
    RecordingError
        It has no episodes, or cannot be read as a whole.
    """
    episodes = list(episodes_of(path))
    if not episodes:
        raise RecordingError(f'{path}: has no files with episodes')
    keys = [_key(one) for one in episodes]
    known = journal.done if journal else {}
    found = {key: known[key] for key in keys if key in known}
    stride = math.ceil(len(episodes) / SOUGHT)
    waiting = [(one, k % stride == 0) for k, one in enumerate(episodes) if keys[k] not in found]
    most = SOUGHT_OF_MANY if len(episodes) > MANY else MOST_EPISODES
    batches = list(_batches(work, most, waiting))
    with shown_bar(len(waiting), 'episodes') as progress:
        results = spread(rows_of_batch, batches, jobs, workers)
        for batch, results_of_batch in zip(batches, results):
            done = [(_key(one), rows) for one, rows in zip(batch.episodes, results_of_batch)]
            found.update(done)
            if journal:
                journal.add(done)
            progress(len(done))
    return [row for key in keys for row in found[key]]


def _key(episode: Episode) -> str:
    # An episode whose file has changed is another one.
    try:
        about = episode.file.stat()
    except OSError:
        return episode.name
    return f'{episode.name} {about.st_size} {about.st_mtime_ns}'


def _batches(
    work: EpisodeWork, most: int, episodes: Sequence[tuple[Episode, bool]]
) -> Iterator[EpisodeBatch]:
    held: list[tuple[Episode, bool]] = []
    frames = 0
    for one in episodes:
        if held and (frames > MOST_FRAMES or len(held) >= MOST_EPISODES):
            yield EpisodeBatch(work, most, *zip(*held))
            held, frames = [], 0
        held.append(one)
        frames += max(one[0].count, 0)
    if held:
        yield EpisodeBatch(work, most, *zip(*held))
