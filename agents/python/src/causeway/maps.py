"""Questions to a map without a running site: lanes and places, many at once.

Places and angles are those of CARLA's client: metres, x east, y south, z up; degrees, yaw
clockwise. The answers come from the program `causeway`, which runs beside while a map is open.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from causeway.messages import encode
from causeway.program import find

#: Bits of CARLA's ``LaneType``, for `lanes`.
DRIVING = 2
ANY = 0xFFFF_FFFE

_KEY = [("road", "i8"), ("section", "i8"), ("lane", "i4")]
_MARK = [("type", "i4"), ("color", "i4"), ("lane_change", "i4"), ("width", "f8")]

#: One row per place: what CARLA's client tells of a waypoint there.
WAYPOINT = np.dtype(
    [
        ("road", "i8"),
        ("section", "i8"),
        ("lane", "i4"),
        *((name, "f8") for name in ("s", "x", "y", "z", "pitch", "yaw", "roll", "width")),
        ("type", "i4"),
        ("lane_change", "i4"),
        # -1 outside of junctions.
        ("junction", "i8"),
        ("rht", "?"),
        # Lane 0 where there is none; lane marks of type -1 likewise.
        ("left", _KEY),
        ("right", _KEY),
        ("left_mark", _MARK),
        ("right_mark", _MARK),
    ]
)
_NOTHING: dict[str, Any] = {
    "junction": -1,
    "left": (-1, -1, 0),
    "right": (-1, -1, 0),
    "left_mark": (-1, -1, -1, 0.0),
    "right_mark": (-1, -1, -1, 0.0),
}

Ident = tuple[int, int, int, float]


@dataclass(frozen=True)
class Waypoints:
    """What was found for each place that was asked for, in its order."""

    #: Of :data:`WAYPOINT`, shape ``(n,)``; zero where nothing was found.
    rows: NDArray[np.void]
    #: Whether there is such a place, shape ``(n,)``.
    found: NDArray[np.bool_]
    #: ``(road, section, lane, s)`` of the places 2 m ahead, and 2 m back.
    next2: list[list[Ident]]
    prev2: list[list[Ident]]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, column: str) -> NDArray[Any]:
        """One column of all rows."""
        return self.rows[column]


class Map:
    """A map of the library, or an OpenDRIVE file; a context manager that ends its program.

    Example::

        with Map("Town03") as town:
            places = town.project([[10.0, 20.0, 0.0], [30.0, 40.0, 0.0]])
            print(places["road"], places["x"], places["yaw"])
    """

    def __init__(
        self, name: str | Path, *, maps: str | Path | None = None, program: str = "causeway"
    ) -> None:
        """Opens a map.

        Args:
            name: of a map that `causeway map list` names, or the path of an ``.xodr`` file.
            maps: folder of OpenDRIVE files that win over maps of the same name.
            program: the command `causeway`, found as :func:`causeway.program.find` does.

        Raises:
            FileNotFoundError: there is no such program.
            ValueError: there is no such map, or it cannot be read.
        """
        path = find(program)
        folder = [] if maps is None else ["--maps", str(maps)]
        self._process = subprocess.Popen(
            [path, "map", "query", *folder, "--", str(name)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            self._ask({"at": {"places": []}})
        except BaseException:
            self.close()
            raise

    def project(self, points: ArrayLike, *, lanes: int = DRIVING) -> Waypoints:
        """The nearest place on a lane of these types for each point, however far away.

        Args:
            points: shape ``(n, 3)`` or, on the ground, ``(n, 2)``; metres.
            lanes: bits of CARLA's ``LaneType``.
        """
        return self._waypoints({"project": {"points": _points(points), "lanes": lanes}})

    def inside(self, points: ArrayLike, *, lanes: int = DRIVING) -> Waypoints:
        """As :meth:`project`, but nothing where the point lies beside that lane."""
        return self._waypoints({"inside": {"points": _points(points), "lanes": lanes}})

    def at(self, road: ArrayLike, lane: ArrayLike, s: ArrayLike) -> Waypoints:
        """The places with these ids of roads and lanes and metres along the road."""
        every = np.broadcast_arrays(np.atleast_1d(road), lane, s)
        places = zip(*(one.ravel().tolist() for one in every), strict=True)
        return self._waypoints({"at": {"places": list(places)}})

    def generate(self, step_m: float) -> Waypoints:
        """Places on all driving lanes, one every `step_m` metres."""
        return self._waypoints({"generate": {"step_m": step_m}})

    def topology(self) -> list[tuple[Ident, Ident]]:
        """Starts of driving lanes, each with the start of a lane that follows it."""
        return [(tuple(a), tuple(b)) for a, b in self._ask({"topology": {}})["pairs"]]

    def close(self) -> None:
        """Ends the program. Closing twice does nothing."""
        if self._process.poll() is None:
            self._process.kill()
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            # What waits to be written goes nowhere.
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
        self._process.wait()

    def __enter__(self) -> Map:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _ask(self, question: dict[str, Any]) -> dict[str, Any]:
        stdin, stdout = self._process.stdin, self._process.stdout
        if stdin is None or stdout is None or stdin.closed:
            raise ValueError("the map is closed")
        try:
            stdin.write(encode(question) + "\n")
            stdin.flush()
            line = stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            said = self._said()
            self.close()
            raise ValueError(said or "the map is closed")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise ValueError(answer["error"])
        return answer

    def _said(self) -> str:
        stderr = self._process.stderr
        return "" if stderr is None or stderr.closed else stderr.read().strip()

    def _waypoints(self, question: dict[str, Any]) -> Waypoints:
        answer = self._ask(question)
        columns, rows = answer["columns"], answer["rows"]
        found = np.array([row is not None for row in rows], dtype=np.bool_)
        table = np.zeros(len(rows), dtype=WAYPOINT)
        here = [row for row in rows if row is not None]
        for name in WAYPOINT.names or ():
            place, nothing = columns.index(name), _NOTHING.get(name, 0)
            values = [nothing if row[place] is None else row[place] for row in here]
            is_record = WAYPOINT[name].names is not None
            table[name][found] = np.array(
                [tuple(value) for value in values] if is_record else values, dtype=WAYPOINT[name]
            )
        return Waypoints(table, found, *(_idents(rows, columns, n) for n in ("next2", "prev2")))


def _points(points: ArrayLike) -> list[list[float]]:
    table = np.asarray(points, dtype=np.float64)
    if table.size == 0:
        return []
    if table.ndim != 2 or table.shape[1] not in (2, 3):
        raise ValueError(f"points have the shape (n, 3) or (n, 2), not {table.shape}")
    if not np.isfinite(table).all():
        raise ValueError("points are finite numbers")
    if table.shape[1] == 2:
        table = np.column_stack([table, np.zeros(len(table))])
    values: list[list[float]] = table.tolist()
    return values


def _idents(rows: list[Any], columns: list[str], name: str) -> list[list[Ident]]:
    place = columns.index(name)
    return [[] if row is None else [tuple(ident) for ident in row[place]] for row in rows]
