"""Episodes step by step, as a policy drives them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from causeway.pictures import Camera, Renderer
from causeway.policy import Policy, observation
from causeway.rollout import Batch

#: Worlds that are driven side by side.
WORLDS = 64
#: Steps that are driven while the pictures of earlier ones are drawn.
AHEAD = 4


@dataclass(frozen=True)
class About:
    """What holds for all episodes of a recording."""

    #: Settings of the batch, as the engine has them.
    spec: Mapping[str, Any]
    #: Of observations: `name`, `unit`, `low`, `high` and `scale` of each.
    columns: Sequence[Mapping[str, Any]]
    episode_columns: Sequence[str]
    step_secs: float
    #: Who drove.
    policy: str


@dataclass(frozen=True)
class Recorded:
    """One whole episode of n steps; every array has a row for each.

    Row k is what was observed before action k, and what came of that.
    """

    #: The seed that begins the same episode again.
    seed: int
    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float32]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    #: Since the episode began, after the step.
    ticks: NDArray[np.uint64]
    #: Of the world, after the step.
    hashes: NDArray[np.uint64]
    #: By name, as :attr:`causeway.rollout.Batch.episodes` has them.
    numbers: Mapping[str, float]
    #: What a camera saw before each action, as JPEG; none where nothing was drawn.
    pictures: Sequence[bytes] = ()

    def __len__(self) -> int:
        return len(self.rewards)

    @property
    def success(self) -> bool:
        return self.numbers["success"] == 1.0


def play(
    task: str,
    policy: Policy,
    *,
    name: str,
    seeds: Sequence[int],
    settings: Mapping[str, Any] | None = None,
    seen: tuple[Renderer, Camera] | None = None,
) -> tuple[About, Iterator[Recorded]]:
    """Opens a batch and drives one episode of each seed; they come in the order of the seeds.

    Args:
        task: as :class:`causeway.rollout.Batch` has it.
        policy: who drives.
        name: what recordings call it.
        seeds: at least one.
        settings: further ones of :class:`causeway.rollout.Batch`.
        seen: who draws what a camera sees before each action; in the tier of rigid bodies alone.

    Raises:
        RendererError: while the episodes are driven: nobody draws.
        ValueError: a setting cannot be, or the policy does not fit.
    """
    if not seeds:
        raise ValueError("there is nothing to record: wanted one seed or more")
    own = {"worlds": min(len(seeds), WORLDS), "agents": 1, "hash_every": 1}
    shown = {"observation": observation(policy), **dict(settings or {})}
    batch = Batch(task, **{**shown, **own, "autoreset": "next_step"})
    about = About(
        spec=batch.spec,
        columns=[vars(column) for column in batch.columns],
        episode_columns=batch.episode_columns,
        step_secs=batch.step_secs,
        policy=name,
    )
    return about, _episodes(batch, policy, list(seeds), seen)


Seen = tuple[Renderer, Camera] | None


def _episodes(batch: Batch, policy: Policy, seeds: list[int], seen: Seen) -> Iterator[Recorded]:
    with batch, ThreadPoolExecutor(1) as pool:
        policy.begin(batch, seeds[0])
        for first in range(0, len(seeds), batch.worlds):
            drawing = Drawing(pool, seen, batch.worlds)
            yield from _drive(batch, policy, seeds[first : first + batch.worlds], drawing)


class Drawing:
    """Pictures of steps, drawn while the next ones are driven."""

    def __init__(self, pool: ThreadPoolExecutor, seen: Seen, worlds: int) -> None:
        self._pool, self._seen = pool, seen
        self._asked: deque[tuple[list[int], Future[list[bytes]]]] = deque()
        #: By row, those that are there.
        self.pictures: list[list[bytes]] = [[] for _ in range(worlds)]

    def ask(self, batch: Batch, rows: list[int]) -> None:
        """For pictures of worlds as they are now."""
        if self._seen is not None:
            renderer, camera = self._seen
            asked = self._pool.submit(renderer.draw, batch.frames(rows), camera)
            self._asked.append((rows, asked))

    def take(self, left: int) -> None:
        """Waits until no more steps than `left` are without their pictures.

        Raises:
            RendererError: nobody draws.
        """
        while len(self._asked) > left:
            rows, asked = self._asked.popleft()
            for row, picture in zip(rows, asked.result(), strict=True):
                self.pictures[row].append(picture)


def _drive(batch: Batch, policy: Policy, seeds: list[int], drawing: Drawing) -> Iterator[Recorded]:
    # Worlds beyond the last seeds go on with whatever comes.
    mask = np.arange(batch.worlds) < len(seeds)
    observations = batch.reset([*seeds, *[None] * (batch.worlds - len(seeds))], mask=mask)
    steps: list[list[tuple[Any, ...]]] = [[] for _ in seeds]
    done: dict[int, Recorded] = {}
    told = 0
    while told < len(seeds):
        rows = [row for row in range(len(seeds)) if row not in done and row >= told]
        drawing.ask(batch, rows)
        before, actions = observations.copy(), policy.act(observations)
        observations, rewards, terminated, truncated = batch.step(actions)
        over = terminated | truncated
        drawing.take(0 if over[rows].any() else AHEAD)
        for row in rows:
            ends = (terminated[row], truncated[row], batch.ticks[row], batch.hashes[row])
            steps[row].append((before[row], actions[row].copy(), rewards[row], *ends))
            if over[row]:
                values = (float(value) for value in batch.episodes[row])
                numbers = dict(zip(batch.episode_columns, values, strict=True))
                done[row] = _recorded(seeds[row], steps[row], numbers, drawing.pictures[row])
                steps[row], drawing.pictures[row] = [], []
        while told in done:
            yield done.pop(told)
            told += 1


def _recorded(
    seed: int, steps: list[tuple[Any, ...]], numbers: dict[str, float], pictures: list[bytes]
) -> Recorded:
    columns = list(zip(*steps, strict=True))
    return Recorded(
        seed=seed,
        observations=np.array(columns[0], np.float32),
        actions=np.clip(np.array(columns[1], np.float32), -1.0, 1.0),
        rewards=np.array(columns[2], np.float32),
        terminated=np.array(columns[3], np.bool_),
        truncated=np.array(columns[4], np.bool_),
        ticks=np.array(columns[5], np.uint64),
        hashes=np.array(columns[6], np.uint64),
        numbers=numbers,
        pictures=pictures,
    )
