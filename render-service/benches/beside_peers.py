"""Pictures of ours and of other simulators for learning, in one run.

    python3.11 -m venv peers
    peers/bin/pip install vizdoom metadrive-simulator==0.3.0.1 panda3d-simplepbr==0.10 \
        panda3d-gltf==0.13
    cargo build --release -p causeway -p render-service --example bare_vulkan
    peers/bin/python render-service/benches/beside_peers.py --program target/release/causeway \
        --bare target/release/examples/bare_vulkan

Each draws pictures in colour on processors, in turns: whatever else the machine does meets all of
them. Rates are of the clock, milliseconds of processors, also of processes that a simulator starts.
A simulator that is not installed, or cannot draw on this machine, is left out and named.

What is drawn differs. ViZDoom draws walls, floors and flat figures by columns, one picture a tic,
on one processor, in sizes of its own. MetaDrive draws its road and cars by OpenGL, one picture a
step; on Mesa's software, with the four samples a pixel that it has and MetaDrive's sky left out,
which takes more than ten times as long as all else there. 0.3.0.1 is the last one whose package has its
models. Bare Vulkan is the same street as ours by a plain graphics pipeline on Mesa's software: flat
colours, no light, no shadows. Ours draws a street of Town10HD_Opt with 12 cars and 12 people,
without stepping a world; of rows with several together each is of another world.
"""

from __future__ import annotations

import argparse
import importlib
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

#: Draws one picture, and what ends the simulator.
Peer = tuple[Callable[[], object], Callable[[], None]]
#: Name, pictures a second, milliseconds of processors for each.
Row = tuple[str, float, float]

ROUNDS, ROUND_SECS, WARM = 3, 2.0, 10
#: Samples of a pixel that Mesa's software has; MetaDrive wants 16.
MESA_SAMPLES = 4
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
    parser.add_argument("--bare", help="the example bare_vulkan; none: left out")
    parser.add_argument("--peer", choices=PEERS, help="measure it alone, once")
    options = parser.parse_args()
    if options.peer:
        draw, close = PEERS[options.peer]()
        figures = measured(draw)
        close()
        print(*figures)
        return 0
    sources: dict[str, Callable[[], Iterator[Row]]] = {
        name: lambda name=name: peer(name) for name in PEERS
    }
    if options.bare:
        sources["bare Vulkan"] = lambda: bare(options.bare)
    else:
        print("bare Vulkan: left out: no --bare", file=sys.stderr)
    for name in OURS:
        sources[name] = lambda name=name: ours(options.program, name)
    taken: dict[str, list[tuple[float, float]]] = {}
    loads: list[float] = []
    for _ in range(ROUNDS):
        loads.append(os.getloadavg()[0])
        for name, measure in list(sources.items()):
            try:
                for row, *figures in measure():
                    taken.setdefault(row, []).append((figures[0], figures[1]))
            # What keeps a simulator from drawing here is told, and the others are measured.
            except (OSError, subprocess.CalledProcessError) as error:
                del sources[name]
                reason = getattr(error, "stderr", None) or str(error)
                print(f"{name}: left out: {reason.splitlines()[-1]}", file=sys.stderr)
    print("| pictures in colour | a second | ms of processors |\n|---|---|---|")
    for name, rounds in taken.items():
        rate, millis = (
            statistics.median(column) for column in zip(*rounds, strict=True)
        )
        rate_text = f"{rate:,.0f}" if rate >= 100.0 else f"{rate:.1f}"
        print(f"| {name.replace(' |', ',')} | {rate_text} | {millis:.2f} |")
    print(f"load {min(loads):.1f} to {max(loads):.1f}, {os.cpu_count()} processors")
    return 0


def peer(name: str) -> Iterator[Row]:
    """A simulator, in a process of its own: some can be there once in a process."""
    command = [sys.executable, str(Path(__file__).resolve()), "--peer", name]
    # ViZDoom leaves a file where it runs.
    with tempfile.TemporaryDirectory() as folder:
        told = subprocess.run(
            command, check=True, capture_output=True, text=True, cwd=folder
        ).stdout
    rate, millis = told.splitlines()[-1].split()
    yield name, float(rate), float(millis)


def ours(program: str, rows: str) -> Iterator[Row]:
    """Rows of our bench that begin like this."""
    command = [program, "bench", "pictures", "--adapter", "cpu"]
    command += ["--secs", str(ROUND_SECS), "--only", rows]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    for line in told.splitlines():
        if line.startswith(f"| {rows} |"):
            rate, _, millis = line.split("|")[5:8]
            yield f"ours: {rows}", float(rate), float(millis)


def bare(program: str) -> Iterator[Row]:
    """Rows of the example."""
    command = [program, "llvmpipe", str(ROUND_SECS)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    for line in told.splitlines():
        if line.startswith("| bare |"):
            size, together, rate, millis = (
                part.strip() for part in line.split("|")[2:6]
            )
            yield f"bare Vulkan: {size} | {together}", float(rate), float(millis)


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
    core = importlib.import_module("panda3d.core")
    # Without a display, on Mesa's software, from one thread.
    options = ("load-display p3headlessgl", "audio-library-name null")
    core.load_prc_file_data("", "\n".join(options))
    simulator = importlib.import_module("metadrive")
    pipeline = importlib.import_module("metadrive.engine.core.our_pbr").OurPipeline
    set_up = pipeline.__init__
    core.ConfigVariableInt("multisamples").value = MESA_SAMPLES
    pipeline.__init__ = lambda self, **wanted: set_up(
        self, **{**wanted, "msaa_samples": MESA_SAMPLES}
    )
    env = simulator.MetaDriveEnv(
        {
            "use_render": False,
            "image_observation": True,
            "multi_thread_render": False,
            "disable_model_compression": True,
            "show_skybox": False,
            "vehicle_config": {
                "image_source": "rgb_camera",
                "rgb_camera": (width, height),
            },
            "rgb_clip": False,
            "horizon": 100_000,
            "traffic_density": 0.1,
        }
    )
    env.reset()

    def draw() -> object:
        seen, _, done, _ = env.step([0.0, 0.1])
        if done:
            env.reset()
        return seen["image"]

    return draw, env.close


#: Simulators by what is drawn with them.
PEERS: dict[str, Callable[[], Peer]] = {
    "ViZDoom, 160 × 120": lambda: vizdoom("RES_160X120"),
    "ViZDoom, 640 × 360": lambda: vizdoom("RES_640X360"),
    "MetaDrive, 84 × 84": lambda: metadrive(84, 84),
    "MetaDrive, 640 × 360": lambda: metadrive(640, 360),
}

if __name__ == "__main__":
    sys.exit(main())
