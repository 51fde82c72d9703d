"""Drivers for batches of worlds: rows of observations in, rows of actions out.

:func:`named` gives one by name: `forward`, `random`, `follow`, `careful`, or a file
that :meth:`Mlp.save` wrote. Anything else with :meth:`Policy.begin` and :meth:`Policy.act`
is a policy, too.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from causeway.rollout import ACTION_WIDTH, Batch

Floats = NDArray[np.float32]

#: Layout of the files of :class:`Mlp`.
FILE_VERSION = 1


class Policy(Protocol):
    """Who drives."""

    def begin(self, batch: Batch, seed: int) -> None:
        """Prepares for the rows of a batch; what is drawn by chance comes from the seed.

        Raises:
            ValueError: its rows are not what this policy knows.
        """

    def act(self, observations: Floats) -> Floats:
        """Actions of shape ``(rows, 2)`` for observations of shape ``(rows, columns)``."""


class Forward:
    """Throttle 0.9, straight on: the least that a benchmark has to tell from driving."""

    def begin(self, batch: Batch, seed: int) -> None:
        del batch, seed

    def act(self, observations: Floats) -> Floats:
        return np.tile(np.array([[0.0, 0.9]], np.float32), (len(observations), 1))


class Random:
    """Actions drawn evenly."""

    def begin(self, batch: Batch, seed: int) -> None:
        del batch
        self._random = np.random.default_rng(seed)

    def act(self, observations: Floats) -> Floats:
        shape = (len(observations), ACTION_WIDTH)
        return self._random.uniform(-1.0, 1.0, shape).astype(np.float32)


class Follow:
    """Steers for the point 7 m ahead on the way, at a speed that bends and limits allow.

    **Source:** pure pursuit; Coulter, "Implementation of the Pure Pursuit Path Tracking
    Algorithm", CMU-RI-TR-92-01, 1992.
    """

    WHEELBASE_M = 2.85
    LOCK_RAD = 0.6
    CRUISE_MPS = 8.0
    SIDEWAYS_MPS2 = 2.0
    BENDS = ("route.4m.curvature", "route.10m.curvature", "route.15m.curvature")

    def begin(self, batch: Batch, seed: int) -> None:
        del seed
        names = [column.name for column in batch.columns]
        normalised = bool(batch.spec["normalise"])
        self._at = {name: names.index(name) for name in ("route.7m.x", "route.7m.y", "ego.speed")}
        self._bends = [names.index(name) for name in self.BENDS]
        scales = [column.scale if normalised else 1.0 for column in batch.columns]
        self._scales = np.array(scales, np.float32)

    def act(self, observations: Floats) -> Floats:
        rows = observations / self._scales
        x, y, speed = (rows[:, at] for at in self._at.values())
        angle = np.arctan(2.0 * self.WHEELBASE_M * y / np.maximum(x * x + y * y, 1.0))
        sharpest = np.maximum(np.abs(rows[:, self._bends]).max(axis=1), 0.01)
        wanted = np.minimum(np.sqrt(self.SIDEWAYS_MPS2 / sharpest), self.CRUISE_MPS)
        pedal = np.clip(wanted - speed, -1.0, 1.0)
        return np.stack([angle / self.LOCK_RAD, pedal], axis=1).astype(np.float32)


class Careful(Follow):
    """As `follow`, and slows down for whoever is on its way and for lights that are not green.

    It reads `observation="drive"`.
    """

    observation = "drive"

    #: From the rear axle to the front bumper, and room kept before others.
    FRONT_M = 3.9
    ROOM_M = 2.5
    #: Half the width that it needs on its way, and for people a little more.
    HALF_WIDTH_M = 1.5
    MORE_TO_WALKERS_M = 0.7
    BRAKE_MPS2 = 3.0
    #: Where others are looked for along the way, in metres, and how far ahead in time.
    REACH_M = np.arange(0.0, 41.0, 1.0)
    LATER_SECS = (0.0, 0.7, 1.4)
    #: From the box centre, to which distances of lights are told, to the front bumper.
    HALF_LENGTH_M = 2.6

    def begin(self, batch: Batch, seed: int) -> None:
        super().begin(batch, seed)
        blocks = {block.name: block for block in batch.blocks}
        if "partners" not in blocks or "light" not in blocks:
            raise ValueError('the policy reads observation="drive"')
        self._blocks = blocks
        names = [column.name for column in batch.columns]
        points = [name.split(".")[1] for name in names if name.endswith("half_width")]
        self._points_m = [0.0, *(float(point.removesuffix("m")) for point in points)]

    def act(self, observations: Floats) -> Floats:
        actions = super().act(observations)
        rows = observations / self._scales
        speed = rows[:, self._at["ego.speed"]]
        wanted = np.minimum(self._others_mps(rows), self._light_mps(rows, speed))
        actions[:, 1] = np.minimum(actions[:, 1], np.clip(wanted - speed, -1.0, 1.0))
        return actions

    def _others_mps(self, rows: Floats) -> NDArray[np.floating[Any]]:
        """As fast as whoever is first on the way allows."""
        route = self._blocks["route"].of(rows)[:, :, :2]
        points = np.concatenate([np.zeros((len(rows), 1, 2)), route], axis=1)
        at = np.interp(self.REACH_M, self._points_m, np.arange(len(self._points_m)))
        low = np.minimum(at.astype(int), len(self._points_m) - 2)
        share = (at - low)[np.newaxis, :, np.newaxis]
        way = points[:, low] * (1.0 - share) + points[:, low + 1] * share
        partners = self._blocks["partners"].of(rows)
        there, walks = partners[..., :2].any(axis=-1), partners[..., 1] > 0.0
        half_m = 0.5 * np.where(walks, 0.6 + 2.0 * self.MORE_TO_WALKERS_M, partners[..., 9])
        along = np.where(walks, 0.0, np.maximum(partners[..., 4], 0.0))
        wanted = np.full(len(rows), np.inf)
        for secs in self.LATER_SECS:
            # Vehicles are where they will be later by their own speed, but none ahead comes nearer.
            places = partners[..., 2:4] + secs * partners[..., 4:6] * walks[..., np.newaxis]
            apart = np.linalg.norm(places[:, :, np.newaxis] - way[:, np.newaxis], axis=-1)
            nearest = apart.argmin(axis=-1)
            beside = np.take_along_axis(apart, nearest[..., np.newaxis], axis=-1)[..., 0]
            hit = there & (places[..., 0] > 0.0) & (beside < self.HALF_WIDTH_M + half_m)
            length = np.where(walks, 0.6, np.abs(partners[..., 6]) * partners[..., 8])
            gap = self.REACH_M[nearest] - self.FRONT_M - 0.5 * length - self.ROOM_M
            allowed = np.sqrt(along**2 + 2.0 * self.BRAKE_MPS2 * np.maximum(gap, 0.0))
            wanted = np.minimum(wanted, np.where(hit, allowed, np.inf).min(axis=-1))
        return wanted

    def _light_mps(
        self, rows: Floats, speed: NDArray[np.floating[Any]]
    ) -> NDArray[np.floating[Any]]:
        """As fast as a light allows that will be red."""
        distance, red, yellow, _ = self._blocks["light"].of(rows)[:, 0].T
        gap = np.maximum(distance - self.HALF_LENGTH_M - 0.5, 0.0)
        can_stop = speed**2 < 2.0 * self.BRAKE_MPS2 * gap
        stop = (red > 0.0) | (yellow > 0.0) & can_stop
        return np.where(stop, np.sqrt(2.0 * self.BRAKE_MPS2 * gap), np.inf)


class Mlp:
    """A network of fully connected layers, tanh between them; its last layer is the action.

    Args:
        layers: weights of shape ``(inputs, outputs)`` and biases of shape ``(outputs,)``.
        columns: names of the columns that it reads, in order.
        scales: by which columns are multiplied that are in their units.
    """

    def __init__(
        self, layers: list[tuple[Floats, Floats]], columns: list[str], scales: list[float]
    ) -> None:
        self.layers = [(weights.astype(np.float32), bias) for weights, bias in layers]
        self.columns = columns
        self.scales = np.array(scales, np.float32)
        self._factors = np.ones(len(columns), np.float32)

    @property
    def observation(self) -> str:
        """What a batch must show it."""
        if "road.0.x" in self.columns:
            return "wide"
        return "drive" if "partners.0.x" in self.columns else "route"

    def begin(self, batch: Batch, seed: int) -> None:
        del seed
        names = [column.name for column in batch.columns]
        if names != self.columns:
            wrong = next((name for name in self.columns if name not in names), "another order")
            raise ValueError(
                f"the policy reads {len(self.columns)} columns, the batch has {len(names)}; "
                f"the first that is not there: {wrong}"
            )
        normalised = bool(batch.spec["normalise"])
        self._factors = np.ones_like(self.scales) if normalised else self.scales

    def act(self, observations: Floats) -> Floats:
        values = observations * self._factors
        for weights, bias in self.layers[:-1]:
            values = np.tanh(values @ weights + bias)
        weights, bias = self.layers[-1]
        return np.clip(values @ weights + bias, -1.0, 1.0)

    def save(self, path: Path) -> None:
        """Writes it as an `.npz` of numbers and names alone."""
        arrays = {f"weights{at}": weights for at, (weights, _) in enumerate(self.layers)}
        arrays |= {f"bias{at}": bias for at, (_, bias) in enumerate(self.layers)}
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(
            path,
            allow_pickle=False,
            version=np.int64(FILE_VERSION),
            columns=np.array(self.columns),
            scales=self.scales,
            **arrays,
        )

    @classmethod
    def load(cls, path: Path) -> Mlp:
        """Reads what :meth:`save` wrote.

        Raises:
            FileNotFoundError: there is no such file.
            ValueError: it is no such file; the text says what it lacks.
        """
        found = _arrays(path)
        version = int(found.get("version", 0))
        if version != FILE_VERSION:
            raise ValueError(f"{path} has version {version} of a policy; wanted {FILE_VERSION}")
        count = sum(name.startswith("weights") for name in found)
        wanted = [f"{kind}{at}" for at in range(count) for kind in ("weights", "bias")]
        lacking = [name for name in (*wanted, "columns", "scales") if name not in found]
        if lacking:
            raise ValueError(f"{path} is no file of a policy: no {', '.join(lacking)}")
        layers = [(found[f"weights{at}"], found[f"bias{at}"]) for at in range(count)]
        width = len(found["columns"])
        ends = layers and (layers[0][0].shape[:1], layers[-1][0].shape[1:])
        if ends != ((width,), (ACTION_WIDTH,)):
            raise ValueError(
                f"{path}: layers from {width} columns to {ACTION_WIDTH} actions wanted"
            )
        return cls(layers, [str(name) for name in found["columns"]], found["scales"].tolist())


def _arrays(path: Path) -> dict[str, Any]:
    """What is in an `.npz`; whatever else a file may be is a `ValueError`."""
    try:
        file = np.load(path, allow_pickle=False)
        if not isinstance(file, NpzFile):
            raise ValueError("it is a single array")
        with file:
            return {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path} is no file of a policy: {error}") from None


#: Policies by name.
NAMES: dict[str, Callable[[], Policy]] = {
    "forward": Forward,
    "random": Random,
    "follow": Follow,
    "careful": Careful,
}


def observation(policy: Policy) -> str:
    """The observation of batches that a policy drives: its `observation`, or else `route`."""
    return str(getattr(policy, "observation", "route"))


def named(text: str) -> Policy:
    """The policy of a name or an `.npz` file.

    Raises:
        FileNotFoundError, ValueError: there is none; the text says which there are.
    """
    if text in NAMES:
        return NAMES[text]()
    if not text.endswith(".npz"):
        raise ValueError(f"no policy {text!r}: wanted {', '.join(NAMES)} or a file FILE.npz")
    return Mlp.load(Path(text))
