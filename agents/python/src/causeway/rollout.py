"""Many worlds at once, their arrays in memory that numpy sees without a copy.

A :class:`Batch` starts the program `causeway` beside, or connects to one that listens::

    with Batch("corl17-straight", worlds=256, town="Town01", seed=7) as batch:
        observations = batch.reset()
        observations, rewards, terminated, truncated = batch.step(policy(observations))

**Frames:** right-handed; x forward, y left; metres, radians, seconds. `docs/rollouts.md` lists
tasks, columns, rewards and ends.
"""

from __future__ import annotations

import weakref
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from causeway.engine import Array, Engine, EngineError

__all__ = ["Batch", "Block", "Column", "EngineError", "WorldFrame"]

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
Step = tuple[Floats, Floats, Flags, Flags]
Autoreset = Literal["next_step", "same_step", "disabled"]

#: Numbers of one action: steering wheel, positive to the left, and pedal, positive for throttle.
ACTION_WIDTH = 2
#: The engine reads seeds of 64 bits.
SEED_END = 2**64
#: The engine tells so many frames in one reply.
FRAMES = 1024
#: A refusal would say the same, later.
_NOTHING_STEPPED = "nothing was stepped"


@dataclass(frozen=True)
class Column:
    """One column of a row of observations; `low` and `high` are in `unit`, before `scale`."""

    name: str
    unit: str
    low: float
    high: float
    scale: float


@dataclass(frozen=True)
class Block:
    """Columns that belong together: `count` things of `width` columns each from `first` on."""

    name: str
    first: int
    count: int
    width: int

    def of(self, observations: Floats) -> Floats:
        """Its part of rows of observations, as a view of shape ``(rows, count, width)``."""
        part = observations[:, self.first : self.first + self.count * self.width]
        return part.reshape(len(observations), self.count, self.width)


@dataclass(frozen=True)
class WorldFrame:
    """A world at one moment, for :mod:`causeway.pictures` and :func:`causeway.frames.decode`."""

    data: bytes
    #: The actor that each agent drives.
    cars: list[int]


class Batch:
    """Worlds that are stepped together; a context manager.

    Rows of every array are agents, world after world. Arrays that are returned lie in one of
    `slots` slots that take turns: they are valid until as many further steps, less one.

    While a step is waited for, other threads of the interpreter run.
    """

    def __init__(
        self,
        task: str = "lane-keep",
        *,
        worlds: int = 1,
        agents: int = 1,
        town: str = "Town01",
        tier: str = "physics",
        seed: int = 0,
        observation: str = "route",
        normalise: bool = True,
        reward: str | Mapping[str, float] = "default",
        ends: str | Sequence[str] | None = None,
        autoreset: Autoreset = "next_step",
        decision_ticks: int = 2,
        horizon_secs: float | None = None,
        pairs: int | None = None,
        cars: int | None = None,
        walkers: int | None = None,
        lights: bool | None = None,
        weathers: str | Sequence[str] = "training",
        hash_every: int = 0,
        slots: int = 2,
        threads: int | None = None,
        address: str | Path | None = None,
        maps: str | Path | None = None,
        tasks: str | Path | None = None,
        program: str = "causeway",
        timeout_secs: float = 60.0,
    ) -> None:
        """Opens a batch; every world is in the first episode of seed `seed + i`.

        Args:
            task: what is to be driven.
            worlds: how many worlds.
            agents: cars in each world that rows are for.
            town: name of a map.
            tier: how exactly vehicles move.
            seed: see above.
            observation: what a row of observations holds.
            normalise: multiplies columns by their scales.
            reward: name of a reward, or weights by term.
            ends: what ends an episode before its time is up; by default the task's.
            autoreset: when the next episode begins.
            decision_ticks: ticks of 50 ms for which an action holds.
            horizon_secs: when an episode is cut off; by default by the length of its way.
            pairs: of a start and a goal to draw from, at most.
            cars: of the world's own traffic; by default the task's.
            walkers: people on foot; by default the task's.
            lights: whether the town's traffic lights take their turns; by default as the task says.
            weathers: of which each start has one: `training` and `test` are the task's, other names
                CARLA's presets.
            hash_every: steps between two hashes of a world's state; 0: at ends of episodes alone.
            slots: copies of all arrays, 2 to 4.
            threads: of the engine; by default one for each 64 worlds, as far as there are cores.
            address: socket of a running `causeway rollout --listen`; else one is started.
            maps: folder of OpenDRIVE files for an engine that is started.
            tasks: folder of tasks, `NAME.toml`, for an engine that is started.
            program: the command `causeway`, found as :func:`causeway.program.find` does.
            timeout_secs: how long a step may take.

        Raises:
            FileNotFoundError: there is no such program or socket.
            TypeError, ValueError: a setting cannot be; the text says what was wanted and what was
                found.
        """
        spec: dict[str, Any] = {
            "task": task,
            "worlds": worlds,
            "agents": agents,
            "town": town,
            "tier": tier,
            "seed": _seed(seed),
            "observation": observation,
            "normalise": normalise,
            "reward": _reward(reward),
            "ends": None if ends is None else _names("ends", ends),
            "autoreset": autoreset,
            "decision_ticks": decision_ticks,
            "horizon_secs": horizon_secs,
            "cars": cars,
            "walkers": walkers,
            "lights": lights,
            "weathers": _names("weathers", weathers),
            "hash_every": hash_every,
        }
        if pairs is not None:
            spec["pairs"] = pairs
        self._engine = Engine(
            {"spec": spec, "slots": slots, "threads": threads},
            address=None if address is None else str(address),
            program=program,
            folders={"maps": maps, "tasks": tasks},
        )
        # Also for a batch that nobody closes.
        self._end = weakref.finalize(self, self._engine.close)
        opened = self._engine.opened
        self.spec: dict[str, Any] = opened["spec"]
        self.columns = [Column(**column) for column in opened["columns"]]
        self.blocks = [Block(**block) for block in opened["blocks"]]
        self.episode_columns: list[str] = opened["episode_columns"]
        self.step_secs: float = opened["step_secs"]
        self.ways_m: list[float] = opened["ways_m"]
        self.threads: int = opened["threads"]
        self.program = program
        self.worlds, self.agents = int(worlds), int(agents)
        self.rows = self.worlds * self.agents
        names = [array["name"] for array in opened["layout"]["arrays"]]
        self._slots = [
            {name: self._engine.array(name, slot) for name in names} for slot in range(slots)
        ]
        self._timeout_secs = timeout_secs
        self._slot = 0
        self._under_way = False

    @property
    def width(self) -> int:
        """Columns of a row of observations."""
        return len(self.columns)

    def __getattr__(self, name: str) -> Array:
        """Arrays of the last step by name, e.g. `rewards`, `episodes`, `seeds`, `hashes`."""
        if not name.startswith("_"):
            found = self._slots[self._slot].get(name)
            if found is not None:
                return found
        raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}")

    def reset(
        self,
        seed: int | Sequence[int | None] | None = None,
        *,
        mask: ArrayLike | None = None,
    ) -> Floats:
        """Begins episodes anew and returns all observations.

        Args:
            seed: world `i` has `seed + i`; or one for each world; `None` goes on with a world's own
                episodes.
            mask: shape ``(worlds,)``: which worlds; the others go on.
        """
        seeds: list[int | None] | None = None
        given = seed.tolist() if isinstance(seed, np.ndarray) else seed
        if isinstance(given, Sequence) and not isinstance(given, str):
            seeds = [None if one is None else _seed(one) for one in given]
        elif given is not None:
            first = _seed(given)
            seeds = [_seed(first + world) for world in range(self.worlds)]
        chosen = None if mask is None else np.asarray(mask)
        if chosen is not None and chosen.dtype != np.bool_:
            raise TypeError(f"the mask has booleans, not {chosen.dtype}")
        self._ask({"reset": {"seeds": seeds, "mask": None if chosen is None else chosen.tolist()}})
        return self._now("observations")

    def step(self, actions: ArrayLike) -> Step:
        """Steps all worlds: observations, rewards, terminations, truncations.

        Args:
            actions: shape ``(rows, 2)`` of floats, beyond -1 to 1 brought there.

        Raises:
            TypeError, ValueError: they are no such actions, or an episode is over while autoreset
                is disabled; nothing was stepped.
            EngineError: the engine has gone, and the worlds with it, or the batch is closed.
        """
        self.send(actions)
        return self.recv()

    def send(self, actions: ArrayLike) -> None:
        """Begins a step, for whoever has something else to do until :meth:`recv`."""
        if self._under_way:
            raise RuntimeError("a step is under way: call recv() first")
        given = np.asarray(actions)
        if given.shape != (self.rows, ACTION_WIDTH):
            raise ValueError(
                f"actions have the wrong shape; wanted {(self.rows, ACTION_WIDTH)}, "
                f"found {given.shape}; {_NOTHING_STEPPED}"
            )
        if given.dtype.kind != "f":
            raise TypeError(
                f"actions have the wrong type; wanted floats, found {given.dtype}; "
                f"{_NOTHING_STEPPED}"
            )
        slot = (self._slot + 1) % len(self._slots)
        self._slots[slot]["actions"][...] = given
        self._engine.ring()
        self._under_way = True

    def recv(self) -> Step:
        """What the step came to that was begun with :meth:`send`."""
        if not self._under_way:
            raise RuntimeError("no step is under way: call send() first")
        try:
            self._engine.wait(self._timeout_secs)
        except TimeoutError:
            raise
        except BaseException as error:
            # After Ctrl-C the step goes on; after a refusal there is none.
            self._under_way = not isinstance(error, (ValueError, EngineError))
            raise
        self._under_way = False
        self._slot = (self._slot + 1) % len(self._slots)
        now = self._slots[self._slot]
        return now["observations"], now["rewards"], now["terminations"], now["truncations"]

    def snapshot(self, worlds: Sequence[int]) -> list[int]:
        """Keeps worlds as they are; returns names for :meth:`restore`."""
        return list(self._ask({"snapshot": {"worlds": [int(world) for world in worlds]}}))

    def restore(
        self, snapshots: Sequence[int], worlds: Sequence[int], *, reseed: bool = False
    ) -> Floats:
        """Lets worlds go on from snapshots, and returns all observations.

        Args:
            snapshots: one for each of the worlds.
            worlds: which.
            reseed: gives each its own later episodes; else they have the snapshot's.
        """
        request = {"snapshots": [int(name) for name in snapshots], "reseed": reseed}
        self._ask({"restore": {**request, "worlds": [int(world) for world in worlds]}})
        return self._now("observations")

    def fork(self, world: int, into: Sequence[int], *, reseed: bool = False) -> Floats:
        """Lets other worlds go on from where one is, as :meth:`restore` does."""
        others = [int(other) for other in into]
        self._ask({"fork": {"world": int(world), "into": others, "reseed": reseed}})
        return self._now("observations")

    def forget(self, snapshots: Sequence[int]) -> None:
        """Gives snapshots up."""
        self._ask({"forget": {"snapshots": [int(name) for name in snapshots]}})

    def frames(self, worlds: Sequence[int]) -> list[WorldFrame]:
        """Worlds as they are, for whoever has them drawn.

        Raises:
            ValueError: there is no such world, or it is a kinematic one.
        """
        names = [int(world) for world in worlds]
        parts = (names[first : first + FRAMES] for first in range(0, len(names), FRAMES))
        return [frame for part in parts for frame in self._frames(part)]

    def _frames(self, worlds: list[int]) -> list[WorldFrame]:
        told = self._reply({"frames": {"worlds": worlds}})["frames"]
        return [
            WorldFrame(self._engine.read(count), cars)
            for count, cars in zip(told["bytes"], told["cars"], strict=True)
        ]

    def _reply(self, request: dict[str, Any]) -> dict[str, Any]:
        if self._under_way:
            raise RuntimeError("a step is under way: call recv() first")
        return self._engine.ask(request)

    def _ask(self, request: dict[str, Any]) -> list[int]:
        """The names in the reply, if there are any; goes to the slot that was written."""
        reply = self._reply(request)
        if "done" in reply:
            self._slot = reply["done"]["slot"]
            return []
        names: list[int] = reply["snapshots"]["snapshots"]
        return names

    def _now(self, name: str) -> Array:
        return self._slots[self._slot][name]

    def engine_secs(self) -> float:
        """Processor time that the engine has taken so far, all of its threads together.

        Raises:
            EngineError: it was not started by this batch, or has gone.
        """
        return self._engine.processor_secs()

    def close(self) -> None:
        """Ends the batch; its worlds are freed. Arrays that are held stay readable."""
        self._end()

    def __enter__(self) -> Batch:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _seed(seed: Any) -> int:
    if not isinstance(seed, (int, np.integer)) or not 0 <= int(seed) < SEED_END:
        raise ValueError(f"a seed is a whole number, 0 to 2**64 - 1, not {seed!r}")
    return int(seed)


def _names(key: str, names: Any) -> list[str]:
    """One name or several."""
    if isinstance(names, str):
        return [names]
    if not isinstance(names, Collection) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"{key} is a name or a list of names, not {names!r}")
    return list(names)


def _reward(reward: Any) -> str | dict[str, float]:
    """A name, or weights by term."""
    if not isinstance(reward, (str, Mapping)):
        raise ValueError(f"reward is a name, or weights by term, not {reward!r}")
    return reward if isinstance(reward, str) else dict(reward)
