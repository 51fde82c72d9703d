"""Small maps with one fault each, by what is wrong with them."""

LINE = '<geometry s="0" x="{x}" y="0" hdg="0" length="{length}"><line/></geometry>'
FLAT = '<elevation s="0" a="0" b="0" c="0" d="0"/>'
WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
CENTRE = '<center><lane id="0" type="none"/></center>'
SIGN = (
    '<signal id="4" name="x" s="{s}" t="-5" zOffset="2" hOffset="0" roll="0" pitch="0" '
    'orientation="-" dynamic="no" country="DE" type="274" subtype="30" value="30" unit="km/h" '
    'text="" height="1" width="1"><validity fromLane="{lane}" toLane="{lane}"/></signal>'
)
OBJECT = (
    '<object id="1" name="{name}" type="x" s="10" t="3" zOffset="0" hdg="0" pitch="0" roll="0" '
    'orientation="+" length="1" width="1" height="1"/>'
)


def lane(number, before=None, after=None, width=WIDTH) -> str:
    links = "" if before is None else f'<predecessor id="{before}"/>'
    links += "" if after is None else f'<successor id="{after}"/>'
    return f'<lane id="{number}" type="driving"><link>{links}</link>{width}</lane>'


def section(s, left="", right="", centre=CENTRE) -> str:
    left = f"<left>{left}</left>" if left else ""
    right = f"<right>{right}</right>" if right else ""
    return f'<laneSection s="{s}">{left}{centre}{right}</laneSection>'


def road(
    number=1,
    x=0,
    length=50,
    links="",
    junction=-1,
    sections=None,
    geometry=LINE,
    elevation=FLAT,
    offset="",
    extra="",
) -> str:
    sections = section(0, right=lane(-1)) if sections is None else sections
    return (
        f'<road id="{number}" name="r{number}" length="{length}" junction="{junction}">'
        f"<link>{links}</link><planView>{geometry.format(x=x, length=length)}</planView>"
        f"<elevationProfile>{elevation}</elevationProfile><lanes>{offset}{sections}</lanes>"
        f"{extra}</road>"
    )


def link(side: str, kind: str, number: int) -> str:
    contact = "start" if side == "successor" else "end"
    return f'<{side} elementType="{kind}" elementId="{number}" contactPoint="{contact}"/>'


def document(*parts: str) -> str:
    return f'<?xml version="1.0"?><OpenDRIVE><header/>{"".join(parts)}</OpenDRIVE>'


def origin(words: str) -> str:
    reference = f"<header><geoReference>{words}</geoReference></header>"
    return document(road()).replace("<header/>", reference)


def two_roads(first: str, second: str) -> str:
    """A road of some sections and one that follows it."""
    return document(
        road(1, links=link("successor", "road", 2), sections=first),
        road(2, x=50, links=link("predecessor", "road", 1), sections=second),
    )


def junction(
    through=None,
    incoming_after=None,
    outgoing_before=None,
    lane_link=(-1, -1),
    connecting=3,
    incoming=1,
    rest="",
    outgoing=None,
) -> str:
    """Road 1, road 3 through junction 100, road 2."""
    start, end = lane_link
    connection = (
        f'<connection id="0" incomingRoad="{incoming}" connectingRoad="{connecting}" '
        f'contactPoint="start"><laneLink from="{start}" to="{end}"/></connection>'
    )
    through = lane(-1, -1, -1) if through is None else through
    outgoing = lane(-1, outgoing_before) if outgoing is None else outgoing
    return document(
        road(
            1,
            links=link("successor", "junction", 100),
            sections=section(0, right=lane(-1, None, incoming_after)),
        ),
        road(
            2,
            x=80,
            links=link("predecessor", "junction", 100),
            sections=section(0, right=outgoing),
        ),
        road(
            3,
            x=50,
            length=30,
            junction=100,
            links=link("predecessor", "road", 1) + link("successor", "road", 2),
            sections=section(0, right=through),
        ),
        f'<junction id="100" name="j">{connection}{rest}</junction>',
    )


def signals(text: str) -> str:
    return document(road(extra=f"<signals>{text}</signals>"))


REFERENCE = '<signalReference id="9" s="1" t="0" orientation="+"/>'
CONTROLLER = '<controller id="5" name="c"><control signalId="99" type="0"/></controller>'
LISTED = '<controller id="5" type="0" sequence="0"/>'
RING = link("predecessor", "road", "{0}") + link("successor", "road", "{0}")
ONE, BACK = lane(-1, -1), lane(-1, None, -1)
NARROW = '<width sOffset="0" a="0.5" b="0" c="0" d="0"/>'


def connection(number: int, incoming: int, connecting: int) -> str:
    return (
        f'<connection id="{number}" incomingRoad="{incoming}" connectingRoad="{connecting}" '
        'contactPoint="start"><laneLink from="-1" to="-1"/></connection>'
    )


def fork(connections: str, inside=(100, 100), approach=None, second=None) -> str:
    """Road 1, then roads 3 and 5 through junction 100, which lead to roads 2 and 4."""
    approach = lane(-1) if approach is None else approach
    second = lane(-1, -1, -1) if second is None else second
    end, start = link("successor", "junction", 100), link("predecessor", "junction", 100)
    before = link("predecessor", "road", 1)
    return document(
        road(1, links=end, sections=section(0, right=approach)),
        road(2, x=80, links=start),
        road(4, x=80, links=start),
        road(
            3,
            x=50,
            length=30,
            junction=inside[0],
            links=before + link("successor", "road", 2),
            sections=section(0, right=lane(-1, -1, -1)),
        ),
        road(
            5,
            x=50,
            length=30,
            junction=inside[1],
            links=before + link("successor", "road", 4),
            sections=section(0, right=second),
        ),
        f'<junction id="100" name="j">{connections}</junction>',
    )


def merge(connections: str, through=None) -> str:
    """Roads 1 and 4, which lead through junction 100 to road 2: the one by 3, the other by 5."""
    inside, after = lane(-1, -1, -1), link("successor", "road", 2)
    through = inside if through is None else through
    leaving = lane(-1) + lane(-2)
    end = link("successor", "junction", 100)
    return document(
        road(1, links=end),
        road(4, links=end),
        road(
            2, x=80, links=link("predecessor", "junction", 100), sections=section(0, right=leaving)
        ),
        *(
            road(
                number,
                x=50,
                length=30,
                junction=100,
                links=link("predecessor", "road", before) + after,
                sections=section(0, right=lanes),
            )
            for number, before, lanes in [(3, 1, through), (5, 4, inside)]
        ),
        f'<junction id="100" name="j">{connections}</junction>',
    )


TWO_WAYS = connection(0, 1, 3) + connection(1, 1, 5)
TWICE = connection(2, 1, 3)

MAPS = {
    "a clean junction": junction(),
    "two clean roads": two_roads(section(0, right=BACK), section(0, right=ONE)),
    "connecting lane from a lane that is not there": junction(lane(-1, -7, -1)),
    "connecting lane into a lane that is not there": junction(lane(-1, -1, -7)),
    "incoming lane leads to nonsense in a junction": junction(incoming_after=-9),
    "outgoing lane comes from nonsense in a junction": junction(outgoing_before=-9),
    "lane links of a junction are nonsense": junction(lane_link=(-8, -9)),
    "incoming road of a connection is unknown": junction(incoming=77),
    "connecting road of a connection is unknown": junction(connecting=77),
    "one lane into two of one connecting road": junction(
        lane(-1, -1, -1) + lane(-2, -1, -2), outgoing=lane(-1) + lane(-2)
    ),
    "one lane into two of a road that joins another": merge(
        connection(0, 1, 3) + connection(1, 4, 5), lane(-1, -1, -1) + lane(-2, -1, -2)
    ),
    "a merge with a connection twice": merge(
        connection(0, 1, 3) + connection(1, 4, 5) + connection(2, 2, 3)
    ),
    "two connections of one road": junction(rest=connection(1, 1, 3)),
    "a connection twice under one id": junction(rest=connection(0, 1, 3)),
    "a fork": fork(TWO_WAYS),
    "a fork with a connection twice": fork(TWO_WAYS + TWICE),
    "the lane beside has another way, and one connection stands twice": fork(
        TWO_WAYS + TWICE, approach=lane(-1) + lane(-2), second=lane(-1, -2, -1)
    ),
    "a fork into roads outside of junctions": fork(TWO_WAYS, inside=(-1, -1)),
    "a fork with one way outside of junctions": fork(TWO_WAYS, inside=(-1, 100)),
    "a fork with a way too narrow for vehicles": fork(
        TWO_WAYS, second=lane(-1, -1, -1, width=NARROW)
    ),
    "lane leads to a lane the next road lacks": two_roads(
        section(0, right=lane(-1, None, -7)), section(0, right=ONE)
    ),
    "lane comes from a lane the road before lacks": two_roads(
        section(0, right=BACK), section(0, right=lane(-1, -7))
    ),
    "lane against s leads to a lane the road before lacks": two_roads(
        section(0, left=lane(1, None, 1)), section(0, left=lane(1, 7))
    ),
    "lane against s comes from a lane the next road lacks": two_roads(
        section(0, left=lane(1, None, 7)), section(0, left=lane(1, 1))
    ),
    "lane leads to one of a later section of the next road": two_roads(
        section(0, right=lane(-1, None, -2)),
        section(0, right=ONE) + section(25, right=lane(-1) + lane(-2)),
    ),
    "lane leads to a lane the next section lacks": document(
        road(sections=section(0, right=lane(-1, None, -7)) + section(25, right=ONE))
    ),
    "lane comes from a lane the section before lacks": document(
        road(sections=section(0, right=BACK) + section(25, right=lane(-1, -7)))
    ),
    "lane against s leads to a lane the section before lacks": document(
        road(sections=section(0, left=lane(1, None, 1)) + section(25, left=lane(1, 7)))
    ),
    "lane against s comes from a lane the next section lacks": document(
        road(sections=section(0, left=lane(1, None, 7)) + section(25, left=lane(1, 1)))
    ),
    "lane ids with a gap": document(road(sections=section(0, right=lane(-1) + lane(-3)))),
    "a ring of two roads": document(
        road(1, links=RING.format(2), sections=section(0, right=lane(-1, -1, -1))),
        road(2, x=50, links=RING.format(1), sections=section(0, right=lane(-1, -1, -1))),
    ),
    "far from the origin": document(road(x=5_300_000)),
    "next road is unknown": document(road(links=link("successor", "road", 55))),
    "no geometry": document(road(geometry="")),
    "geometry begins late": document(road(geometry=LINE.replace('s="0"', 's="10"'))),
    "lane offset begins late": document(road(offset='<laneOffset s="5" a="0" b="0" c="0" d="0"/>')),
    "elevation begins late": document(road(elevation=FLAT.replace('s="0"', 's="5"'))),
    "no elevation": document(road(elevation="")),
    "width begins late": document(
        road(sections=section(0, right=lane(-1, width=WIDTH.replace('"0"', '"5"', 1))))
    ),
    "no width": document(road(sections=section(0, right=lane(-1, width="")))),
    "no centre lane": document(road(sections=section(0, right=lane(-1), centre=""))),
    "only a centre lane": document(road(), road(2, x=50, sections=section(0))),
    "first section begins late": document(road(sections=section(5, right=lane(-1)))),
    "a section beyond the road": document(
        road(sections=section(0, right=BACK) + section(80, right=ONE))
    ),
    "a section at the end of the road": document(
        road(sections=section(0, right=lane(-1)) + section(50, right=lane(-1)))
    ),
    "a section just before the end of the road": document(
        road(sections=section(0, right=lane(-1)) + section(49.999, right=lane(-1)))
    ),
    "two sections at one place": document(
        road(sections=section(0, right=lane(-1)) + 2 * section(20, right=lane(-1)))
    ),
    "two sections at one place, one of them without lanes": document(
        road(sections=section(0) + section(0, right=lane(-1)))
    ),
    "an origin that is no number": origin("+proj=tmerc +lat_0=north +lon_0=8"),
    "an origin without number": origin("+lon_0="),
    "an origin beyond all numbers": origin("+lat_0=1e400"),
    "an origin below all numbers": origin("+lat_0=1e-400"),
    "an origin of not a number": origin("+lat_0=nan"),
    "an origin with a letter after it": origin("+lat_0=49x"),
    "a zero byte": document(road()).replace("r1", "r\0"),
    "a road without length": document(road(length=0)),
    "a spiral that is none": document(
        road(geometry=LINE.replace("<line/>", '<spiral curvStart="0.01" curvEnd="0.01"/>'))
    ),
    "an arc that is none": document(road(geometry=LINE.replace("<line/>", '<arc curvature="0"/>'))),
    "a road in a ring with itself": document(
        road(
            links=link("predecessor", "road", 1) + link("successor", "road", 1),
            sections=section(0, right=lane(-1, -1, -1)),
        )
    ),
    "an empty junction": document(road(), '<junction id="100" name="j"/>'),
    "a reference to an unknown signal": signals(REFERENCE),
    "a signal before the road": signals(SIGN.format(s=-3, lane=-1)),
    "a signal beyond the road": signals(SIGN.format(s=300, lane=-1)),
    "a signal for lanes that are not there": signals(SIGN.format(s=3, lane=9)),
    "a signal at no number": signals(SIGN.format(s="nan", lane=-1)),
    "a controller of an unknown signal": document(road(), CONTROLLER),
    "a junction with a controller of an unknown signal": junction(rest=LISTED).replace(
        "</OpenDRIVE>", f"{CONTROLLER}</OpenDRIVE>"
    ),
    "a junction with an unknown controller": junction(rest=LISTED),
    "a speed object without number": document(
        road(extra=f"<objects>{OBJECT.format(name='Speed_')}</objects>")
    ),
    "a speed object with a word": document(
        road(extra=f"<objects>{OBJECT.format(name='Speed_limit')}</objects>")
    ),
}
