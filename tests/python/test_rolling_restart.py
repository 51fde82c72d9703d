"""Goal: every service of a site is replaced once while people use it, and nobody loses an episode.

Method: two of each service of one bus, players who go from one episode to the next at whichever
scenario service takes them, and a CARLA client with a Traffic Manager. One service after the other
gets a successor and is told to end; what players and client saw is compared with a quiet site.
"""

import contextlib
import functools
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from types import SimpleNamespace

import causeway
import pytest

from running_site import two_free_ports
from watched import Service, eventually, figures, services

pytest.importorskip("carla", reason="the client is not installed")

from test_traffic_manager import drive as drive_traffic

PLAYERS = 8
SEEDS = 4
STEPS = 40
CONFIG = {"num_npc_vehicles": 2, "num_pedestrians": 2, "ticks_per_step": 4}
DRAIN = ("--drain-secs", "120")
#: Seconds of driving on any machine, so that most of the site is replaced meanwhile.
TRAFFIC = {"vehicles": 10, "ticks": 1_500}


def play(url: str, seed: int) -> list:
    """What an episode shows, with a picture in the middle."""
    with causeway.Session(url) as session:
        step = session.reset("free_roam", scenario_config=CONFIG, seed=seed, episode_id="e")
        seen = [step.observation]
        for index in range(STEPS):
            if index == STEPS // 2:
                assert session.capture().startswith(b"\xff\xd8"), "no JPEG"
            steer = 0.05 * (index % 3 - 1)
            seen.append(session.step("control", throttle=0.4, steer=steer).observation)
            time.sleep(0.005)
        return seen


class Site:
    """Services of one bus, each of which can be replaced."""

    def __init__(self, start) -> None:
        self.start = start
        self.ports = [two_free_ports(), two_free_ports()]
        self.routers = [self.router(port) for port in self.ports]
        self.worlds, self.renderers = ([self.service(kind)] for kind in ("world", "render"))
        self.worlds.append(self.service("world"))
        self.faces = [self.face(), self.face()]
        self.carla_port = two_free_ports()
        self.gateway = self.carla_gateway()

    def router(self, port: int) -> Service:
        others = [other for other in self.ports if other != port]
        flags = [word for other in others for word in ("--connect", f"tcp/127.0.0.1:{other}")]
        router = self.start("router", "--listen", f"tcp/127.0.0.1:{port}", *flags)
        router.until("/readyz", 200)
        return router

    def service(self, *command: str) -> Service:
        bus = [word for port in self.ports for word in ("--connect", f"tcp/127.0.0.1:{port}")]
        service = self.start(*command, *bus, *DRAIN)
        service.until("/readyz", 200)
        return service

    def face(self) -> Service:
        return self.service("scenario", "--http", "127.0.0.1:0")

    def carla_gateway(self) -> Service:
        return self.service("gateway", "--port", str(self.carla_port))

    def all(self) -> list[Service]:
        return [*self.worlds, *self.renderers, *self.faces, self.gateway]

    def roll(self, services_: list[Service], make) -> None:
        """Gives each a successor, and tells it to end then."""
        for index, old in enumerate(services_):
            services_[index] = make()
            end(old)

    def roll_routers(self) -> None:
        for index, port in enumerate(self.ports):
            self.routers[index].terminate()
            self.routers[index].ended()
            self.routers[index] = self.router(port)
            for service in self.all():
                eventually("router", functools.partial(is_connected, service))


def is_connected(service: Service) -> bool:
    return figures(service.admin)["causeway_bus_routers"] >= 1


def end(old: Service) -> None:
    old.terminate()
    assert old.ended() == 0
    assert "lost=0" in old.said(), old.said()


class Players:
    """People who play one episode after the other, wherever they are taken."""

    def __init__(self, site: Site) -> None:
        self.site, self.over = site, threading.Event()
        self.pool = ThreadPoolExecutor(PLAYERS)
        self.playing: list[Future] = [
            self.pool.submit(self.play_on, number) for number in range(PLAYERS)
        ]

    def play_on(self, number: int) -> list[tuple[int, list]]:
        found = []
        while not self.over.is_set():
            seed = (number + len(found)) % SEEDS
            for face in tuple(self.site.faces):
                url = "http://" + face.find(r"OpenEnv face listens address=(\S+)")
                # One that ends takes no new sessions, and may be gone by now.
                try:
                    found.append((seed, play(url, seed)))
                    break
                except ConnectionError:
                    continue
        return found

    def ended(self) -> list[tuple[int, list]]:
        self.over.set()
        with self.pool:
            return [one for done in self.playing for one in done.result(300)]


def test_every_service_is_replaced_while_people_use_the_site(tmp_path, site):
    wanted = [play(site.base_url, seed) for seed in range(SEEDS)]
    wanted_trace = drive_traffic(site, "Town03", **TRAFFIC)["trace"]
    with services(tmp_path) as start, contextlib.ExitStack() as stack:
        rolled = Site(start)
        players = Players(rolled)
        stack.callback(players.over.set)
        pool = stack.enter_context(ThreadPoolExecutor(1))
        there = SimpleNamespace(carla_port=rolled.carla_port)
        traffic = pool.submit(drive_traffic, there, "Town03", **TRAFFIC)
        eventually("clients", lambda: figures(rolled.gateway.admin)["causeway_gateway_clients"])
        rolled.roll(rolled.worlds, lambda: rolled.service("world"))
        was_driving = not traffic.done()
        rolled.roll_routers()
        rolled.roll(rolled.renderers, lambda: rolled.service("render"))
        rolled.roll(rolled.faces, rolled.face)
        # A client of CARLA cannot go elsewhere: its gateway ends after it.
        rolled.gateway.terminate()
        trace = traffic.result(300)["trace"]
        end_of_gateway = rolled.gateway.ended()
        found = players.ended()
        counted = [figures(face.admin) for face in rolled.faces]
    assert end_of_gateway == 0 and "lost=0" in rolled.gateway.said()
    assert was_driving
    assert trace == wanted_trace
    for seed, seen in found:
        assert seen == wanted[seed], seed
    assert sum(one["causeway_scenario_episodes_lost_total"] for one in counted) == 0
    print(f"{len(found)} episodes, none lost")
