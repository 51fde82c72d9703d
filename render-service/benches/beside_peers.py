"""Pictures of ours and of other simulators for learning, in one run.

    python -m venv peers && peers/bin/pip install vizdoom metadrive-simulator==0.4.3
    peers/bin/python render-service/benches/beside_peers.py --program target/release/causeway

Each draws pictures in colour on processors, in turns: whatever else the machine does meets all of
them. Rates are of the clock, milliseconds of processors, also of processes that a simulator starts.
A simulator that is not installed, or cannot draw on this machine, is left out and named.

What is drawn differs. ViZDoom draws walls, floors and flat figures by columns, one picture a tic,
on one processor, in sizes of its own. MetaDrive draws its road and cars by OpenGL, one picture a
step. Ours draws a street of Town10HD_Opt with 12 cars and 12 people, without stepping a world; of
rows with several together each is of another world.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

#: Draws one picture, and what ends the simulator.
Peer = tuple[Callable[[], object], Callable[[], None]]

ROUNDS, ROUND_SECS, WARM = 3, 2.0, 10
#: What simulators raise that are not there or find no display.
FAULTS = (
    AssertionError,
    AttributeError,
    ImportError,
    OSError,
    RuntimeError,
    ValueError,
)
#: Of the system's clock of processes.
TICKS_A_SEC = 100.0
OURS = (
    "colour, raw | 84 × 84 | low | 256",
    "colour, raw | 84 × 84 | high | 256",
    "colour, raw | 84 × 84 | high | 1",
    "colour, raw | 640 × 360 | low | 1",
    "colour, raw | 640 × 360 | high | 1",
)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--program", default="causeway", help="ours (%(default)s)")
    options = parser.parse_args()
    peers: dict[str, Peer] = {}
    for name, make in (
        ("ViZDoom, 160 × 120", lambda: vizdoom("RES_160X120")),
        ("ViZDoom, 640 × 360", lambda: vizdoom("RES_640X360")),
        ("MetaDrive, 84 × 84", lambda: metadrive(84, 84)),
        ("MetaDrive, 640 × 360", lambda: metadrive(640, 360)),
    ):
        try:
            peers[name] = make()
        # What keeps a simulator from drawing here is told, and the others are measured.
        except FAULTS as error:
            print(f"{name}: left out: {error}", file=sys.stderr)
    taken: dict[str, list[tuple[float, float]]] = {}
    for _ in range(ROUNDS):
        for name, (draw, _) in peers.items():
            taken.setdefault(name, []).append(measured(draw))
        for name in OURS:
            for rate, millis in ours(options.program, name):
                taken.setdefault(f"ours: {name}", []).append((rate, millis))
    for _, close in peers.values():
        close()
    print("| pictures in colour | a second | ms of processors |\n|---|---|---|")
    for name, figures in taken.items():
        rate, millis = (
            statistics.median(column) for column in zip(*figures, strict=True)
        )
        print(f"| {name.replace(' |', ',')} | {rate:,.0f} | {millis:.2f} |")
    return 0


def ours(program: str, rows: str) -> Iterator[tuple[float, float]]:
    """Rate and milliseconds of processors of rows of our bench."""
    command = [program, "bench", "pictures", "--adapter", "cpu"]
    command += ["--secs", str(ROUND_SECS), "--only", rows]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    for line in told.splitlines():
        if line.startswith(f"| {rows} |"):
            rate, _, millis = line.split("|")[5:8]
            yield float(rate), float(millis)


def measured(draw: Callable[[], object]) -> tuple[float, float]:
    """Pictures a second, and milliseconds of processors for each."""
    for _ in range(WARM):
        draw()
    begun, used, count = time.perf_counter(), processor_secs(), 0
    while time.perf_counter() - begun < ROUND_SECS:
        draw()
        count += 1
    secs = time.perf_counter() - begun
    return count / secs, 1000.0 * (processor_secs() - used) / count


def processor_secs() -> float:
    """Of this process and of those that it has started and that still run."""
    total = time.process_time()
    for task in Path("/proc/self/task").iterdir():
        for child in (task / "children").read_text().split():
            fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
            total += (int(fields[11]) + int(fields[12])) / TICKS_A_SEC
    return total


def vizdoom(size: str) -> Peer:
    module = importlib.import_module("vizdoom")
    game = module.DoomGame()
    game.load_config(str(Path(module.scenarios_path) / "basic.cfg"))
    game.set_screen_resolution(getattr(module.ScreenResolution, size))
    game.set_screen_format(module.ScreenFormat.RGB24)
    game.set_window_visible(False)
    game.init()
    idle = [0.0] * game.get_available_buttons_size()

    def draw() -> object:
        if game.is_episode_finished():
            game.new_episode()
        pixels = game.get_state().screen_buffer
        game.make_action(idle)
        return pixels

    return draw, game.close


def metadrive(width: int, height: int) -> Peer:
    simulator = importlib.import_module("metadrive")
    cameras = importlib.import_module("metadrive.component.sensors.rgb_camera")
    env = simulator.MetaDriveEnv(
        {
            "use_render": False,
            "image_observation": True,
            "image_on_cuda": False,
            "sensors": {"eye": (cameras.RGBCamera, width, height)},
            "vehicle_config": {"image_source": "eye"},
            "stack_size": 1,
            "horizon": 100_000,
            "traffic_density": 0.1,
            "log_level": logging.ERROR,
        }
    )
    env.reset()

    def draw() -> object:
        seen, _, terminated, truncated, _ = env.step([0.0, 0.1])
        if terminated or truncated:
            env.reset()
        return seen["image"]

    return draw, env.close


if __name__ == "__main__":
    sys.exit(main())
