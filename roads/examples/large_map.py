"""A map as large as CARLA's largest: a grid of junctions that are all connected.

Usage: large_map.py SIDE [--sidewalks] > maps/Grid.xodr
SIDE by SIDE junctions, 60 m apart, with one lane in each direction and every turn; 50 make 33,708
roads. Says on stderr how many there are.
"""

import argparse
import math
import sys

APART_M = 60.0
RADIUS_M = 10.0
FIRST_JUNCTION = 1_000_000
HEAD = (
    '<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4" name="grid" version="1" '
    'north="0" south="0" east="0" west="0"/>'
)


def lane(number: int, kind: str, width_m: float, link: str = "") -> str:
    mark = '<roadMark sOffset="0" type="solid" weight="standard" color="white" width="0.15"/>'
    return (
        f'<lane id="{number}" type="{kind}" level="false">{link}'
        f'<width sOffset="0" a="{width_m}" b="0" c="0" d="0"/>{mark}</lane>'
    )


def road(number: int, junction: int, links: str, shape: tuple, lanes: str, limit_kmh: int) -> str:
    x, y, heading, length_m, curve = shape
    return (
        f'<road name="{number}" length="{length_m}" id="{number}" junction="{junction}">'
        f'<link>{links}</link><type s="0" type="town"><speed max="{limit_kmh}" unit="km/h"/></type>'
        f'<planView><geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length_m}">{curve}'
        f'</geometry></planView><lanes><laneSection s="0">{lanes}</laneSection></lanes></road>'
    )


def streets(side: int) -> dict:
    """Numbers of roads by the junction they begin at and their direction: 0 east, 1 north."""
    places = [(i, j, d) for i in range(side) for j in range(side) for d in (0, 1)]
    inside = [(i, j, d) for i, j, d in places if (j if d else i) + 1 < side]
    return {place: number for number, place in enumerate(inside, 1)}


def street(number: int, place: tuple, side: int, sidewalks: bool) -> str:
    i, j, d = place
    after = (i, j + 1) if d else (i + 1, j)
    links = "".join(
        f'<{tag} elementType="junction" elementId="{FIRST_JUNCTION + a * side + b}"/>'
        for tag, (a, b) in (("predecessor", (i, j)), ("successor", after))
    )
    x, y = i * APART_M + (0 if d else RADIUS_M), j * APART_M + (RADIUS_M if d else 0)
    shape = (x, y, d * math.pi / 2, APART_M - 2 * RADIUS_M, "<line/>")
    walks = [lane(number, "sidewalk", 2.0) if sidewalks else "" for number in (2, -2)]
    lanes = (
        f"<left>{walks[0]}{lane(1, 'driving', 3.5)}</left>"
        '<center><lane id="0" type="none" level="false"/></center>'
        f"<right>{lane(-1, 'driving', 3.5)}{walks[1]}</right>"
    )
    return road(number, -1, links, shape, lanes, 50)


def arms(numbers: dict, i: int, j: int) -> list:
    """The roads of a junction: number, the end that is there, and the direction away from it."""
    found = [
        ((i, j, 0), "start", 0.0),
        ((i, j, 1), "start", math.pi / 2),
        ((i - 1, j, 0), "end", math.pi),
        ((i, j - 1, 1), "end", -math.pi / 2),
    ]
    return [(numbers[place], *rest) for place, *rest in found if place in numbers]


def turn(number: int, junction: int, middle: tuple, incoming: tuple, outgoing: tuple) -> tuple:
    """A way through a junction, and the connection that names it."""
    (from_road, from_end, away), (to_road, to_end, out) = incoming, outgoing
    heading = away + math.pi
    by = (out - heading + math.pi) % (2 * math.pi) - math.pi
    curve, length_m = "<line/>", 2 * RADIUS_M
    if abs(by) > 0.01:
        curve = f'<arc curvature="{math.copysign(1 / RADIUS_M, by)}"/>'
        length_m = RADIUS_M * math.pi / 2
    links = (
        f'<predecessor elementType="road" elementId="{from_road}" contactPoint="{from_end}"/>'
        f'<successor elementType="road" elementId="{to_road}" contactPoint="{to_end}"/>'
    )
    from_lane, to_lane = -1 if from_end == "end" else 1, -1 if to_end == "start" else 1
    link = f'<link><predecessor id="{from_lane}"/><successor id="{to_lane}"/></link>'
    center = '<center><lane id="0" type="none" level="false"/></center>'
    lanes = f"{center}<right>{lane(-1, 'driving', 3.5, link)}</right>"
    x, y = middle[0] + RADIUS_M * math.cos(away), middle[1] + RADIUS_M * math.sin(away)
    text = road(number, junction, links, (x, y, heading, length_m, curve), lanes, 30)
    connection = (
        f'<connection id="{number}" incomingRoad="{from_road}" connectingRoad="{number}" '
        f'contactPoint="start"><laneLink from="{from_lane}" to="-1"/></connection>'
    )
    return text, connection


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("side", type=int)
    parser.add_argument("--sidewalks", action="store_true")
    args = parser.parse_args()
    numbers = streets(args.side)
    print(HEAD)
    for place, number in numbers.items():
        print(street(number, place, args.side, args.sidewalks))
    number, junctions = len(numbers), []
    for i in range(args.side):
        for j in range(args.side):
            junction, connections = FIRST_JUNCTION + i * args.side + j, []
            there = arms(numbers, i, j)
            for incoming, outgoing in ((a, b) for a in there for b in there if a != b):
                number += 1
                middle = (i * APART_M, j * APART_M)
                text, connection = turn(number, junction, middle, incoming, outgoing)
                print(text)
                connections.append(connection)
            head = f'<junction id="{junction}" name="{junction}">'
            junctions.append(f"{head}{''.join(connections)}</junction>")
    print("\n".join(junctions), "</OpenDRIVE>")
    print(f"{number} roads", file=sys.stderr)


if __name__ == "__main__":
    main()
