# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
"""Audit a dataset by one or several processes."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from .....errors import RecordingError
from ...datasets.episodes import Episode, episodes_of
from ..report.audit_runs import shown_bar, spread
from .episode_audit import EpisodeBatch, EpisodeRow, EpisodeWork, rows_of_batch

# A batch of episodes is closed after this number of frames, which take some seconds to audit.
MAX_BATCH_FRAMES = 2**16
# Largest number of episodes in a batch.
MAX_BATCH_EPISODES = 64
# If measured and computed tool poses differ by less than the limit of WARN, the cause is searched
# only in about this number of episodes, evenly spread over the dataset. The search is slow, and a
# small mistake in the robot file affects all episodes alike.
SEARCHED_EPISODES = 200
# A dataset is large if its number of episodes exceeds this. A large difference between measured
# and computed tool poses usually has the same cause in all episodes. So in a large dataset the
# cause is searched only in a few episodes of each batch, see SEARCHED_OF_BATCH.
LARGE_DATASET = 2000
# In a large dataset, the cause of a large difference between measured and computed tool poses is
# searched in at most this number of episodes of each batch.
SEARCHED_OF_BATCH = 2


def rows_of_dataset(
    path: Path, work: EpisodeWork, jobs: int, workers: str | None
) -> list[EpisodeRow]:
    """
    Return the rows of the result table for all episodes of a dataset, in the order of the
    episodes.

    Raises
    ------
    RecordingError
        The dataset lacks episodes, or cannot be read.
    """
    episodes = list(episodes_of(path))
    if not episodes:
        message = f'{path}: has no files with episodes; add .parquet, .hdf5 or .npz files'
        raise RecordingError(message, code='empty')
    stride = math.ceil(len(episodes) / SEARCHED_EPISODES)
    sought = [(episode, k % stride == 0) for k, episode in enumerate(episodes)]
    max_searches = SEARCHED_OF_BATCH if len(episodes) > LARGE_DATASET else MAX_BATCH_EPISODES
    rows = []
    with shown_bar(len(episodes), 'episodes') as progress:
        batches = list(_batches(work, max_searches, sought))
        for rows_of_episodes in spread(rows_of_batch, batches, jobs, workers):
            for rows_of_episode in rows_of_episodes:
                rows += rows_of_episode
            progress(len(rows_of_episodes))
    return rows


def _batches(
    work: EpisodeWork, max_searches: int, episodes: Sequence[tuple[Episode, bool]]
) -> Iterator[EpisodeBatch]:
    held: list[tuple[Episode, bool]] = []
    frames = 0
    for pair in episodes:
        if held and (frames > MAX_BATCH_FRAMES or len(held) >= MAX_BATCH_EPISODES):
            yield EpisodeBatch(work, max_searches, *zip(*held))
            held, frames = [], 0
        held.append(pair)
        frames += max(pair[0].count, 0)
    yield EpisodeBatch(work, max_searches, *zip(*held))
