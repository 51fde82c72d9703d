"""World services that go one after the other, killed or told to end, while episodes are played."""

import itertools
import signal
import statistics
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import carla
import causeway

from carla_site import fresh, spawn_car, synchronous
from watched import Service, figures

PLAYERS = 8
SEEDS = 4
#: Of an episode of OpenEnv, and of one of CARLA's client, whose beginning takes longer.
STEPS, TICKS = 150, 30
CONFIG = {"num_npc_vehicles": 2, "num_pedestrians": 2, "ticks_per_step": 4}
#: Between two services that go.
QUIET_SECS = 0.3
#: What somebody who goes may hold up.
AFTER_SECS = 5.0
WAYS = ("killed", "drained")


@dataclass
class Record:
    """When what went, and how long each step took: (player, begin, seconds)."""

    gone: list[tuple[str, float]] = field(default_factory=list)
    steps: list[tuple[int, float, float]] = field(default_factory=list)

    def pauses_secs(self, way: str) -> list[float]:
        """The longest step of each player after each service that went this way."""
        longest: dict[tuple, float] = {}
        for at in (at for gone, at in self.gone if gone == way):
            for player, begun, secs in self.steps:
                if begun + secs >= at and begun <= at + AFTER_SECS:
                    longest[at, player] = max(secs, longest.get((at, player), 0.0))
        return sorted(longest.values())

    def told(self, way: str) -> str:
        pauses = self.pauses_secs(way)
        if not pauses:
            return f"{way}: none"
        p50, p99 = statistics.median(pauses), pauses[int(0.99 * (len(pauses) - 1))]
        count = Counter(gone for gone, _ in self.gone)[way]
        return (
            f"{way}: {count} services, longest step of a player p50 {1e3 * p50:.0f} ms, "
            f"p99 {1e3 * p99:.0f} ms, max {1e3 * pauses[-1]:.0f} ms"
        )


def play(url: str, seed: int, note=lambda begun: None) -> list:
    """What an episode of OpenEnv shows."""
    with causeway.Session(url) as session:
        step = session.reset("free_roam", scenario_config=CONFIG, seed=seed, episode_id="e")
        seen = [step.observation]
        for index in range(STEPS):
            begun = time.monotonic()
            steer = 0.05 * (index % 3 - 1)
            seen.append(session.step("control", throttle=0.4, steer=steer).observation)
            note(begun)
        return seen


def drive(port: int, note=lambda begun: None) -> list:
    """What a client of CARLA sees of an episode."""
    world = fresh(port).get_world()
    seen = []
    with synchronous(world):
        car = spawn_car(world, 3)
        for index in range(TICKS):
            begun = time.monotonic()
            car.apply_control(carla.VehicleControl(throttle=0.6, steer=0.1 * (index % 3 - 1)))
            world.tick()
            note(begun)
            at, moves = car.get_transform(), car.get_velocity()
            seen.append((str(at), moves.x, moves.y, moves.z))
    return seen


class GoingHosts:
    """Two world services, one of which always goes next, until it is over."""

    def __init__(self, start, ways=WAYS) -> None:
        self.start, self.ways = start, itertools.cycle(ways)
        self.names = itertools.count()
        self.hosts = [self.another(), self.another()]
        self.record, self.over = Record(), threading.Event()

    def another(self) -> Service:
        host = self.start("world", "--id", f"world-{next(self.names)}", "--drain-secs", "120")
        host.until("/readyz", 200)
        return host

    def go_on(self) -> None:
        while not self.over.wait(QUIET_SECS):
            way, old = next(self.ways), self.hosts.pop(0)
            self.hosts.append(self.another())
            self.record.gone.append((way, time.monotonic()))
            if way == "killed":
                old.process.send_signal(signal.SIGKILL)
            else:
                old.terminate()
            assert old.ended() == (-signal.SIGKILL if way == "killed" else 0)
            if way == "drained":
                assert "lost=0" in old.said(), old.said()

    def outlive(self, url: str, port: int, episodes: int, drives: int) -> tuple[list, list]:
        """What so many episodes of each kind show meanwhile, with their seeds."""
        numbers = iter(range(episodes))
        lock = threading.Lock()

        def noted(player: int):
            def note(begun: float) -> None:
                self.record.steps.append((player, begun, time.monotonic() - begun))

            return note

        def player(number: int) -> list:
            found = []
            while True:
                with lock:
                    episode = next(numbers, None)
                if episode is None:
                    return found
                seed = episode % SEEDS
                found.append((seed, play(url, seed, noted(number))))

        with ThreadPoolExecutor(PLAYERS + 2) as pool:
            going = pool.submit(self.go_on)
            playing = [pool.submit(player, number) for number in range(PLAYERS)]
            try:
                driven = [drive(port, noted(PLAYERS)) for _ in range(drives)]
                played = [one for done in playing for one in done.result()]
            finally:
                self.over.set()
            going.result()
        return played, driven


def lost(*faces: Service) -> float:
    """Worlds and episodes that faces have lost for good."""
    names = ("causeway_scenario_episodes_lost_total", "causeway_gateway_worlds_lost_total")
    return sum(figures(face.admin).get(name, 0.0) for face in faces for name in names)
