"""What the examples share: options, connecting, synchronous mode, clearing up, the end."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time
from collections.abc import Callable, Iterator

try:
    import carla
except ImportError:
    carla = None  # type: ignore[assignment]

__all__ = ["carla", "cast", "connect", "finish", "options_of", "synchronous", "tell"]

#: How long a call may take, and how long to wait between two attempts to connect.
CALL_SECS = 20.0
ATTEMPT_SECS = 2.0
PAUSE_SECS = 1.0


def options_of(text: str) -> argparse.ArgumentParser:
    """A parser with the options that every example takes; `text` is the example's docstring."""
    parser = argparse.ArgumentParser(description=text.splitlines()[0])
    parser.add_argument(
        "--host",
        default=os.environ.get("CARLA_HOST", "localhost"),
        help="of the server; $CARLA_HOST if that is set (default: %(default)s)",
    )
    parser.add_argument(
        *("-p", "--port"),
        type=int,
        default=os.environ.get("CARLA_PORT", "2000"),
        help="of the server; $CARLA_PORT if that is set (default: %(default)s)",
    )
    parser.add_argument(
        *("-v", "--verbose"), action="store_true", help="tell on stderr what is done"
    )
    return parser


def connect(options: argparse.Namespace) -> carla.Client:
    """A client of the server, as soon as there is one: each attempt that fails prints a line."""
    if carla is None:
        raise RuntimeError("the package carla is missing: pip install -r requirements.txt")
    while True:
        # A client that has found nobody does not look again.
        client = carla.Client(options.host, options.port)
        client.set_timeout(ATTEMPT_SECS)
        try:
            version = client.get_server_version()
        except RuntimeError as error:
            reason = str(error).splitlines()[0]
            print(f"{options.host}:{options.port}: {reason}; trying again", file=sys.stderr)
            time.sleep(PAUSE_SECS)
            continue
        client.set_timeout(CALL_SECS)
        tell(options, f"connected to {options.host}:{options.port}, version {version}")
        return client


def tell(options: argparse.Namespace, text: str) -> None:
    if options.verbose:
        print(text, file=sys.stderr)


@contextlib.contextmanager
def synchronous(world: carla.World, step_secs: float) -> Iterator[None]:
    """The world waits for `tick()` inside, and has the settings from before afterwards."""
    before = world.get_settings()
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = step_secs
    world.apply_settings(settings)
    try:
        yield
    finally:
        world.apply_settings(before)


@contextlib.contextmanager
def cast(client: carla.Client, manager: carla.TrafficManager | None = None) -> Iterator[list[int]]:
    """A list for the ids of the actors that an example spawns; they go at the end.

    `manager`: the Traffic Manager that drives some of them."""
    ids: list[int] = []
    try:
        yield ids
    finally:
        # The client goes on to lead walkers whose controllers are destroyed, and may end with them.
        actors = client.get_world().get_actors(ids)
        for controller in actors.filter("controller.*"):
            controller.stop()
        # Nor does the Traffic Manager survive each car that goes while it drives it.
        if manager is not None:
            free = carla.command.SetAutopilot
            cars = [one.id for one in actors.filter("vehicle.*")]
            client.apply_batch_sync([free(car, False, manager.get_port()) for car in cars])
        # Those that were spawned last may be attached to those before.
        client.apply_batch_sync([carla.command.DestroyActor(one) for one in reversed(ids)])


def finish(work: Callable[[argparse.Namespace], None], options: argparse.Namespace) -> None:
    """Does the work and ends the process: with 0, 1 after an error, 130 after Ctrl-C."""
    status = 0
    try:
        work(options)
    except KeyboardInterrupt:
        print("cancelled", file=sys.stderr)
        status = 130
    except (OSError, RuntimeError, ValueError) as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    # The client library may end the process when it is taken down in order.
    os._exit(status)
