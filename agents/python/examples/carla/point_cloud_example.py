"""Turns pictures of depth into coloured point clouds of the world, one PLY file a frame.

causeway up
python point_cloud_example.py --frames 10

A car of the Traffic Manager carries a colour and a depth camera. Points are in CARLA's axes of the
world, in metres: x, y to its right, z up, left-handed; most viewers of PLY show them mirrored.
"""

from __future__ import annotations

import argparse
import math
import random
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rig import Rig
from simulator import carla, cast, connect, finish, options_of, synchronous, tell

STEP_SECS = 0.1
CAMERA = {"image_size_x": 800, "image_size_y": 600, "fov": 70}
#: From the middle of the car, on the ground: over its roof, so that it sees nothing of itself.
PLACE_M = (0.3, 0.0, 2.5)
#: What depth pictures code as 1.
FAR_M = 1000.0
#: What the car drives before the first picture, so that wheels stand on the road.
FIRST_TICKS = 10

VERTEX = np.dtype(
    [(name, "<f4") for name in ("x", "y", "z")]
    + [(name, "u1") for name in ("red", "green", "blue")]
)


def main() -> None:
    parser = options_of(__doc__ or "")
    parser.add_argument("--frames", type=int, default=10, help="to save (default: %(default)s)")
    parser.add_argument(
        "--max-depth", type=float, default=200.0, metavar="M", help="(default: %(default)s)"
    )
    parser.add_argument(
        *("-i", "--images-to-disk"), action="store_true", help="save both pictures as PNG, too"
    )
    parser.add_argument("--seed", type=int, help="of the start, which is drawn by chance")
    parser.add_argument(
        "--out", type=Path, default=Path("_out"), help="where to save (default: %(default)s)"
    )
    parser.add_argument(
        "--tm-port", type=int, default=8000, help="of the Traffic Manager (default: %(default)s)"
    )
    finish(run, parser.parse_args())


def run(options: argparse.Namespace) -> None:
    client = connect(options)
    world = client.get_world()
    manager = client.get_trafficmanager(options.tm_port)
    manager.set_synchronous_mode(True)
    options.out.mkdir(parents=True, exist_ok=True)
    with synchronous(world, STEP_SECS), cast(client, manager) as ids:
        blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
        start = random.Random(options.seed).choice(world.get_map().get_spawn_points())
        vehicle = world.spawn_actor(blueprint, start)
        ids.append(vehicle.id)
        vehicle.set_autopilot(True, manager.get_port())
        for _ in range(FIRST_TICKS):
            world.tick()
        rig = Rig(world, vehicle)
        try:
            place = carla.Transform(carla.Location(*PLACE_M))
            rig.add("rgb", "sensor.camera.rgb", place, CAMERA)
            rig.add("depth", "sensor.camera.depth", place, CAMERA)
            for number in range(options.frames):
                pictures = rig.measured(world.tick())
                save(number, pictures["rgb"], pictures["depth"], options)
        finally:
            rig.remove()


def save(number: int, colour: carla.Image, depth: carla.Image, options: argparse.Namespace) -> None:
    depths_m = depths_of(depth)
    near = depths_m < options.max_depth
    camera = np.array(depth.transform.get_matrix())
    points_m = points_of(depths_m, depth.fov, camera)[near]
    path = options.out / f"{number:05}.ply"
    write_ply(path, camera[:3, 3], points_m, pixels(colour)[near][:, 2::-1])
    print(f"saved {path}: {len(points_m)} points")
    if options.images_to_disk:
        colour.save_to_disk(str(options.out / "CameraRGB" / f"{number:05}.png"))
        depth.save_to_disk(str(options.out / "CameraDepth" / f"{number:05}.png"))
        tell(options, f"saved pictures of frame {depth.frame}")


def pixels(image: carla.Image) -> NDArray[np.uint8]:
    """Rows and columns of blue, green, red, alpha."""
    return np.frombuffer(image.raw_data, np.uint8).reshape(image.height, image.width, 4)


def depths_of(image: carla.Image) -> NDArray[np.float64]:
    """Along the camera's axis, in metres: 24 bits, red the lowest byte."""
    blue, green, red = (pixels(image)[..., channel].astype(np.float64) for channel in range(3))
    return FAR_M * (red + 256.0 * green + 65536.0 * blue) / (2**24 - 1)


def points_of(
    depths_m: NDArray[np.float64], fov_deg: float, camera: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The point of each pixel in the axes of the world; `camera` is its transform, 4 by 4."""
    height, width = depths_m.shape
    focal_px = width / 2.0 / math.tan(math.radians(fov_deg) / 2.0)
    columns = (np.arange(width) + 0.5 - width / 2.0) / focal_px
    rows = (np.arange(height) + 0.5 - height / 2.0) / focal_px
    right, down = np.meshgrid(columns, rows)
    ahead = np.stack([np.ones_like(right), right, -down], axis=-1) * depths_m[..., None]
    world: NDArray[np.float64] = ahead @ camera[:3, :3].T + camera[:3, 3]
    return world


def write_ply(
    path: Path,
    camera_m: NDArray[np.float64],
    points_m: NDArray[np.float64],
    colours: NDArray[np.uint8],
) -> None:
    """A binary PLY file of points with red, green and blue; a comment says where the camera was."""
    vertices = np.empty(len(points_m), VERTEX)
    for axis, name in enumerate(("x", "y", "z")):
        vertices[name] = points_m[:, axis]
    for channel, name in enumerate(("red", "green", "blue")):
        vertices[name] = colours[:, channel]
    kinds = {"<f4": "float", "|u1": "uchar"}
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        "comment CARLA's axes of the world, m: left-handed, z up",
        "comment camera {:.4f} {:.4f} {:.4f}".format(*camera_m),
        f"element vertex {len(vertices)}",
        *(f"property {kinds[VERTEX[name].str]} {name}" for name in VERTEX.names or ()),
        "end_header\n",
    ]
    path.write_bytes("\n".join(lines).encode() + vertices.tobytes())


if __name__ == "__main__":
    main()
