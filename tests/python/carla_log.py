"""A reader of CARLA's recordings of its own: what the format is documented to be, nothing of ours.

Lengths are centimetres, angles degrees, in the order roll, pitch, yaw.
"""

import os
import struct
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import pytest

START, END, ADD, DESTROY, PARENT, COLLISION, POSITION, STATE, CONTROL, WALKER, LIGHTS = range(11)
SCENE_LIGHT, KINEMATICS, BOX, PLATFORM_TIME, PHYSICS, LIGHT_TIMES, VOLUME = range(11, 18)
BONES, VISUAL_TIME, WHEELS, BIKER, DOOR, WEATHER = range(19, 25)
# Ids above this one are left to others.
FOREIGN = 100

# Of packets whose records are of one size.
RECORDS = {
    DESTROY: "<I",
    PARENT: "<II",
    COLLISION: "<IIIBB",
    POSITION: "<I6f",
    STATE: "<IBfB",
    CONTROL: "<I3fBi",
    WALKER: "<If",
    LIGHTS: "<II",
    SCENE_LIGHT: "<i5fBB",
    KINEMATICS: "<I6f",
    BOX: "<I6f",
    LIGHT_TIMES: "<I3f",
    VOLUME: "<I6f",
    BIKER: "<Iff",
    DOOR: "<IBB",
}


@dataclass
class Frame:
    """Records by packet; `ids` has the packets in the order of the file."""

    number: int
    duration: float
    elapsed: float
    ids: list[int] = field(default_factory=list)
    records: dict[int, list] = field(default_factory=lambda: defaultdict(list))

    def by_actor(self, packet: int) -> dict[int, tuple]:
        return {record[0]: record[1:] for record in self.records[packet]}


@dataclass
class Log:
    version: int
    date: int
    map: str
    frames: list[Frame]


class Body:
    """What is left of some bytes."""

    def __init__(self, data: bytes):
        self.data, self.at = data, 0

    def take(self, layout: str) -> tuple:
        values = struct.unpack_from(layout, self.data, self.at)
        self.at += struct.calcsize(layout)
        return values

    def text(self) -> str:
        (length,) = self.take("<H")
        self.at += length
        assert self.at <= len(self.data)
        return self.data[self.at - length : self.at].decode()

    def is_used_up(self) -> bool:
        return self.at == len(self.data)


def actor(body: Body) -> tuple:
    id_, class_, *pose = body.take("<IB6f")
    (uid,) = body.take("<I")
    blueprint = body.text()
    (count,) = body.take("<H")
    attributes = {}
    for _ in range(count):
        (kind,) = body.take("<B")
        name = body.text()
        attributes[name] = (kind, body.text())
    return id_, class_, tuple(pose), uid, blueprint, attributes


def physics(body: Body) -> tuple:
    (id_,) = body.take("<I")
    numbers = body.take("<5fB4f3f")
    lists = [
        [body.take(layout) for _ in range(*body.take("<I"))]
        for layout in ("<2f", "<3f", "<2f", "<12f")
    ]
    return id_, numbers, *lists


def bones(body: Body) -> tuple:
    id_, count = body.take("<IH")
    return id_, [(body.text(), body.take("<6f")) for _ in range(count)]


def wheels(body: Body) -> tuple:
    id_, count = body.take("<II")
    return id_, [body.take("<Bff") for _ in range(count)]


READERS = {ADD: actor, PHYSICS: physics, BONES: bones, WHEELS: wheels}
SINGLE = {PLATFORM_TIME: "<d", VISUAL_TIME: "<d", WEATHER: "<14f"}


def read(path: Path) -> Log:
    """A whole log; every packet is to be used up by its records."""
    body = Body(path.read_bytes())
    (version,) = body.take("<H")
    assert body.text() == "CARLA_RECORDER"
    (date,) = body.take("<q")
    log = Log(version, date, body.text(), [])
    while not body.is_used_up():
        id_, size = body.take("<BI")
        packet = Body(body.data[body.at : body.at + size])
        assert len(packet.data) == size, "the file ends within a packet"
        body.at += size
        # Not of CARLA, whose readers skip it.
        if id_ > FOREIGN:
            continue
        if id_ == START:
            log.frames.append(Frame(*packet.take("<Qdd")))
        frame = log.frames[-1]
        frame.ids.append(id_)
        if id_ in SINGLE:
            frame.records[id_] = [packet.take(SINGLE[id_])]
        elif id_ in READERS or id_ in RECORDS:
            (count,) = packet.take("<H")
            one = READERS.get(id_) or (lambda body, layout=RECORDS[id_]: body.take(layout))
            frame.records[id_] += [one(packet) for _ in range(count)]
        else:
            assert id_ in (START, END), f"packet {id_}"
        assert packet.is_used_up(), (
            f"packet {id_} of frame {frame.number} is longer than its records"
        )
    assert all(frame.ids[0] == START and frame.ids[-1] == END for frame in log.frames)
    return log


def genuine(name: str) -> Path:
    """A log that CARLA 0.9.13 wrote; the test is skipped where there is none."""
    default = Path(__file__).parent.parent.parent / ".." / "shared" / "recordings"
    folder = Path(os.environ.get("CAUSEWAY_RECORDINGS_DIR", default)).resolve()
    path = folder / f"{name}.log"
    if not path.exists():
        pytest.skip(f"no recordings in {folder}; set CAUSEWAY_RECORDINGS_DIR")
    return path
