"""Drivers for batches of worlds: rows of observations in, rows of actions out.

:func:`named` gives one by name: `forward`, `random`, `follow`, or a file that
:meth:`Mlp.save` wrote. Anything else with :meth:`Policy.begin` and :meth:`Policy.act`
is a policy, too.
"""

from __future__ import annotations

import zipfile
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
NAMES: dict[str, type[Forward] | type[Random] | type[Follow]] = {
    "forward": Forward,
    "random": Random,
    "follow": Follow,
}


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
