"""Traffic of our own beside SUMO's: junctions, and time for a step.

    python -m venv peer && peer/bin/pip install eclipse-sumo==1.28.0
    cargo build --release --workspace --bin causeway --examples
    peer/bin/python world-service/world/benches/beside_sumo.py --built target/release

Both drive the same vehicles over the same roads of the same network, which `netconvert` makes of
our town's OpenDRIVE: SUMO's take the ways that ours took, as far as they get in the same time.
Lights have the same phases and times. SUMO's drivers are once like ours (IDM, same parameters, as
slow in turns) and once SUMO's own (Krauss, defaults).
"""

import argparse
import json
import resource
import subprocess
import sysconfig
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

SCRIPTS = Path(sysconfig.get_path("scripts"))
TOWNS = [
    ("Town03_Opt", 100),
    ("Town05_Opt", 100),
    ("Town05_Opt", 200),
    ("Town10HD_Opt", 100),
]
STEPPED = "Town05_Opt"
VEHICLES = [1, 10, 50, 100, 200]
STEP_SECS = 0.05
GREEN_SECS, YELLOW_SECS, RED_SECS = 10, 3, 2
# As `agents/src/traffic/manner.rs` and `SpawnTraffic` have it: one of three is cautious.
LIKE_OURS = [
    'carFollowModel="IDM" accel="1.2" decel="2.0" tau="1.9" minGap="2.5" speedFactor="0.85"',
    'carFollowModel="IDM" accel="1.8" decel="2.0" tau="1.4" minGap="2.0" speedFactor="1.0"',
    'carFollowModel="IDM" accel="1.8" decel="2.0" tau="1.4" minGap="2.0" speedFactor="1.0"',
]
SUMO_OWN = [""]
# Sideways acceleration in turns: as our normal drivers have it, and SUMO's.
TURN_MPS2, TURN_MPS2_OWN = 2.2, 5.5


class Town:
    """A town of ours as a network of SUMO's."""

    def __init__(self, built, name, folder, turn_mps2):
        self.folder, self.turn_mps2 = folder, turn_mps2
        drive, self.net = folder / f"{name}.xodr", folder / f"{name}.net.xml"
        quiet(built / "causeway", "map", "export", name, "-o", drive)
        junctions = ET.parse(drive).getroot().findall("junction")
        self.junctions = [junction.get("id") for junction in junctions]
        lit = {junction.get("id") for junction in junctions if junction.findall("controller")}
        self.convert(drive, [])
        found = {light.get("id") for light in ET.parse(self.net).getroot().findall("tlLogic")}
        # SUMO takes signs, and lights that no controller lists, for lights.
        self.convert(drive, ["--tls.unset", ",".join(sorted(found - lit))] if found - lit else [])
        tree = ET.parse(self.net)
        for phase in tree.getroot().iter("phase"):
            state = phase.get("state")
            secs = YELLOW_SECS if "y" in state else RED_SECS if set(state) == {"r"} else GREEN_SECS
            phase.set("duration", str(secs))
        tree.write(self.net)
        edges = [
            edge for edge in tree.getroot().findall("edge") if edge.get("function") != "internal"
        ]
        self.leads_to = {edge.get("id"): edge.get("to") for edge in edges}
        self.edges_of = {}
        # A road with several lane sections becomes several edges, `ID#0`, `ID#1`, along the road;
        # those without a minus are driven against it.
        for edge in sorted(self.leads_to, key=lambda id: int((id + "#0").split("#")[1])):
            road = self.edges_of.setdefault(edge.split("#")[0], [])
            road.insert(len(road) if edge.startswith("-") else 0, edge)
        links = tree.getroot().findall("connection")
        self.links = {(link.get("from"), link.get("to")) for link in links}

    def convert(self, drive, options):
        turns = ("--junctions.limit-turn-speed", self.turn_mps2)
        quiet(
            SCRIPTS / "netconvert",
            "--opendrive-files",
            drive,
            "-o",
            self.net,
            *turns,
            *options,
        )

    def route(self, roads):
        """Edges of a way over roads, as far as SUMO's network leads."""
        route = []
        for edge in [edge for road in roads for edge in self.edges_of.get(road, [])]:
            if route and (route[-1], edge) not in self.links:
                break
            route.append(edge)
        return route

    def drive(self, ways, secs, kinds):
        """CPU seconds of SUMO, and passes by junction."""
        lines = [f'<vType id="{index}" length="4.6" {kind}/>' for index, kind in enumerate(kinds)]
        for index, roads in enumerate(ways):
            route = " ".join(self.route(roads))
            lines.append(
                f'<vehicle id="{index}" type="{index % len(kinds)}" depart="0" departPos="random"'
                f' departLane="random"><route edges="{route}"/></vehicle>'
            )
        routes, edges = self.folder / "routes.xml", self.folder / "edges.xml"
        routes.write_text(f"<routes>{''.join(lines)}</routes>")
        more = self.folder / "more.xml"
        more.write_text(f'<additional><edgeData id="all" file="{edges}"/></additional>')
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        files = ["-n", self.net, "-r", routes, "-a", more]
        times = ["--step-length", STEP_SECS, "--end", secs, "--time-to-teleport", "-1"]
        silent = ["--no-step-log", "true", "--no-warnings", "true"]
        quiet(SCRIPTS / "sumo", *files, *times, *silent)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        passes = dict.fromkeys(self.junctions, 0)
        for edge in ET.parse(edges).getroot().iter("edge"):
            to = self.leads_to.get(edge.get("id"))
            if to in passes:
                passes[to] += int(edge.get("left"))
        cpu_secs = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return cpu_secs, passes


def quiet(*words):
    words = [str(word) for word in words]
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def junctions(built, folder, minutes):
    print("| town | vehicles | | passes per hour | busiest junction | least |")
    print("|---|---|---|---|---|---|")
    for name, count in TOWNS:
        told = json.loads(quiet(built / "examples" / "junctions", name, count, minutes))
        ways, secs = told["routes"], 60 * minutes
        town = Town(built, name, folder, TURN_MPS2)
        rows = {"ours": {id: told["passes"].get(id, 0) for id in town.junctions}}
        rows["SUMO, drivers like ours"] = town.drive(ways, secs, LIKE_OURS)[1]
        town = Town(built, name, folder, TURN_MPS2_OWN)
        rows["SUMO, its own drivers"] = town.drive(ways, secs, SUMO_OWN)[1]
        for who, passes in rows.items():
            hourly = [60 * passed / minutes for passed in passes.values()]
            print(
                f"| {name} | {count} | {who} | {sum(hourly):.0f} | {max(hourly):.0f}"
                f" | {min(hourly):.0f} |",
                flush=True,
            )


def steps(built, folder, secs=300):
    """SUMO's time of a step, less that of starting and loading."""
    town = Town(built, STEPPED, folder, TURN_MPS2)
    ways = json.loads(quiet(built / "examples" / "junctions", STEPPED, VEHICLES[-1], 5))["routes"]
    print("| vehicles | SUMO, one step, µs | steps/s |")
    print("|---|---|---|")
    for count in VEHICLES:
        few = ways[:count]
        whole, start = (
            town.drive(few, secs, LIKE_OURS)[0],
            town.drive(few, 1, LIKE_OURS)[0],
        )
        micros = 1e6 * (whole - start) / ((secs - 1) / STEP_SECS)
        print(f"| {count} | {micros:.0f} | {1e6 / micros:.0f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--built", type=Path, required=True, help="folder of built programs")
    parser.add_argument("--minutes", type=int, default=30)
    parser.add_argument("what", nargs="*", default=["junctions", "steps"])
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if "junctions" in args.what:
            junctions(args.built, Path(folder), args.minutes)
        if "steps" in args.what:
            steps(args.built, Path(folder))


if __name__ == "__main__":
    main()
