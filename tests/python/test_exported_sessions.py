"""What an export has of the journal of a session's world."""

import json
import math

from mcap.reader import make_reader

from driving import act, session
from test_exact_recordings import told


def test_the_way_of_a_navigation_agent_is_told_when_it_changes(start_site, tmp_path):
    site = start_site("--no-render")
    at = ("--connect", site.endpoint)
    with session(site.base_url) as env:
        env.reset(scenario_name="free_roam_Town10HD_Opt_v0_p0", seed=3)
        world = told("worlds", *at).split()[0]
        journal = told("start", "--world", world, *at).split()[0]
        for _ in range(5):
            act(env)
        observation = act(env, "init_navigation_agent").observation
        x, y, *_ = observation.location
        act(env, "follow_route", route_steps=5)
        heading = math.radians(observation.rotation[1])
        goal = (x + 60.0 * math.cos(heading), y + 60.0 * math.sin(heading))
        act(env, "set_destination", destination_x=goal[0], destination_y=goal[1])
        for _ in range(4):
            act(env, "follow_route", route_steps=5)
        told("stop", "--world", world, *at)
    path = site.log.parent / "recordings" / journal
    out = tmp_path / "session.mcap"
    told("export", path, "--to", out)
    with out.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        frames = sum(1 for _ in reader.iter_messages(topics=["/ego/pose"]))
        told_ways = list(reader.iter_messages(topics=["/ego/path"]))
    schema, _, last = told_ways[-1]
    assert schema.name == "foxglove.PosesInFrame"
    assert 1 <= len(told_ways) < frames
    way = json.loads(last.data)
    assert way["frame_id"] == "map" and len(way["poses"]) >= 2
    # CARLA's y axis is turned: towards the destination, along the way.
    ends = [pose["position"] for pose in (way["poses"][0], way["poses"][-1])]
    apart = [math.dist((end["x"], end["y"]), (goal[0], -goal[1])) for end in ends]
    assert apart[1] < 10.0 and apart[1] < apart[0]
