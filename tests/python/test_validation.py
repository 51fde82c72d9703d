"""Which actions are accepted and how others are refused.

The oracle is the Python validator itself, on the model that a user of the client writes.
"""

import json
import math

import pytest
from pydantic import ValidationError

from carla_models import CarlaAction
from wire import wire

ACCEPTED = [
    {},
    {"action_type": "observe", "metadata": {"note": [1, {"deep": None}]}},
    {"action_type": "control", "throttle": "0.5", "steer": " -0.25 ", "brake": "1e-1"},
    {"action_type": "control", "throttle": True, "brake": False},
    {"action_type": "control", "throttle": 1, "steer": -1},
    {"action_type": "brake_vehicle", "brake_intensity": None},
    {"action_type": "maintain_speed", "target_speed_kmh": "30"},
    {"action_type": "lane_change", "lane_direction": "left"},
    {"route_steps": 2.0},
    {"route_steps": "3"},
    {"route_steps": "2.0"},
    {"route_steps": True},
    {"route_steps": None},
    {"route_steps": "1_0.0"},
    {"target_speed_kmh": "1_0.5"},
    {"destination_x": -1e300, "destination_y": "12.5", "destination_z": None},
]

REFUSED = [
    {"throttle": 2},
    {"throttle": -0.1},
    {"steer": 1.01},
    {"steer": "-7"},
    {"brake": "hard"},
    {"brake": ""},
    {"brake": None},
    {"brake": [1]},
    {"brake": {"value": 1}},
    {"target_speed_kmh": 200.5},
    {"brake_intensity": "1.5"},
    {"action_type": "fly"},
    {"action_type": None},
    {"action_type": 3},
    {"lane_direction": 5},
    {"target_lane_id": True},
    {"navigation_behavior": ["normal"]},
    {"route_steps": 0},
    {"route_steps": 2.5},
    {"route_steps": "2.5"},
    {"route_steps": "many"},
    {"route_steps": "1e1"},
    {"route_steps": "1__0"},
    {"route_steps": [1]},
    {"metadata": []},
    {"metadata": None},
    {"metadata": "note"},
    {"speed": 3},
    {"ünknown": None, "another": {}},
    {"extra": 1, "brake": 9, "throttle": "x", "action_type": "fly"},
]


@pytest.fixture
def connection(base_url):
    with wire(base_url) as connection:
        connection.reset(scenario_name="trolley_saves", seed=1)
        yield connection


@pytest.mark.parametrize("action", ACCEPTED, ids=json.dumps)
def test_what_the_validator_accepts_is_accepted(connection, action):
    CarlaAction(**action)
    assert connection.ask({"type": "step", "data": action})["type"] == "observation"


@pytest.mark.parametrize("action", REFUSED, ids=json.dumps)
def test_what_the_validator_refuses_is_refused_with_the_same_errors(connection, action):
    with pytest.raises(ValidationError) as refusal:
        CarlaAction(**action)
    expected = json.loads(refusal.value.json(include_url=False))
    reply = connection.ask({"type": "step", "data": action})
    assert reply["type"] == "error"
    assert (reply["data"]["code"], reply["data"]["message"]) == (
        "VALIDATION_ERROR",
        "Invalid message",
    )
    found = [
        {key: error[key] for key in error if key != "url"} for error in reply["data"]["errors"]
    ]
    assert found == expected
    assert connection.ask({"type": "state"})["type"] == "state", "the session must survive"


def test_coerced_values_are_the_ones_that_act(connection):
    """A quarter of braking as text brakes like a quarter of braking as number."""
    speeds = []
    for quarter in (0.25, " 0.25 "):
        connection.reset(scenario_name="trolley_saves", seed=1)
        connection.step(action_type="brake_vehicle", brake_intensity=quarter)
        speeds.append(connection.step(action_type="observe")["observation"]["speed_kmh"])
    assert speeds[0] == speeds[1]
    connection.reset(scenario_name="trolley_saves", seed=1)
    connection.step(action_type="observe")
    assert connection.step(action_type="observe")["observation"]["speed_kmh"] > speeds[0] + 0.3


@pytest.mark.parametrize("literal", ["NaN", "Infinity", "-Infinity"])
def test_numbers_that_json_does_not_have_are_an_error_and_not_the_end(connection, literal):
    reply = connection.ask(
        '{"type":"step","data":{"action_type":"observe","destination_x":' + literal + "}}"
    )
    assert reply["type"] == "error"
    assert reply["data"]["code"] in ("VALIDATION_ERROR", "INVALID_JSON")
    assert connection.ask({"type": "state"})["type"] == "state"


def test_a_number_that_overflows_is_refused(connection):
    reply = connection.ask('{"type":"step","data":{"throttle":1e999}}')
    assert reply["type"] == "error"
    assert reply["data"]["code"] in ("VALIDATION_ERROR", "INVALID_JSON")


@pytest.mark.parametrize(
    ("message", "code", "text"),
    [
        ("", "INVALID_JSON", "Invalid JSON: "),
        ("{", "INVALID_JSON", "Invalid JSON: "),
        ("[1]", "INVALID_JSON", ""),
        ("3", "INVALID_JSON", ""),
        (b"\xff\xfe", "INVALID_JSON", ""),
        ("{}", "UNKNOWN_TYPE", "Unknown message type: "),
        ('{"type":null}', "UNKNOWN_TYPE", "Unknown message type: None"),
        ('{"type":"jump"}', "UNKNOWN_TYPE", "Unknown message type: jump"),
        ('{"type":"step"}', "VALIDATION_ERROR", "Invalid message"),
        ('{"type":"step","data":3}', "VALIDATION_ERROR", "Invalid message"),
        ('{"type":"step","data":{},"extra":1}', "VALIDATION_ERROR", "Invalid message"),
        ('{"type":"reset","data":[]}', "VALIDATION_ERROR", "Invalid message"),
        ('{"type":"state","data":{}}', "VALIDATION_ERROR", "Invalid message"),
        ("[" * 100_000, "INVALID_JSON", ""),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_message_of_the_wrong_shape_is_answered_and_the_session_goes_on(
    connection, message, code, text
):
    reply = connection.ask(message)
    assert reply["type"] == "error"
    assert reply["data"]["code"] == code
    assert reply["data"]["message"].startswith(text)
    assert len(reply["data"]["message"]) < 2_000
    assert connection.ask({"type": "state"})["type"] == "state"


def test_a_text_in_a_binary_frame_is_understood(connection):
    assert connection.ask(b'{"type":"state"}')["type"] == "state"


def test_pipelined_requests_are_answered_in_order(connection):
    connection.reset(scenario_name="trolley_saves", seed=1)
    for _ in range(20):
        connection.send({"type": "step", "data": {}})
    connection.send({"type": "state"})
    steps = [connection.receive()["data"]["observation"]["step_number"] for _ in range(20)]
    assert steps == list(range(1, 21))
    assert connection.receive()["data"]["step_count"] == 20


@pytest.mark.parametrize(
    ("data", "loc"),
    [({"seed": -1}, "seed"), ({"seed": "x"}, "seed"), ({"episode_id": "e" * 256}, "episode_id")],
    ids=["negative seed", "seed that is a word", "long name"],
)
def test_a_reset_with_a_wrong_seed_or_name_is_refused(connection, data, loc):
    reply = connection.ask({"type": "reset", "data": data})
    assert reply["type"] == "error"
    assert loc in json.dumps(reply["data"])


def test_no_reply_holds_a_number_that_json_does_not_have(connection):
    def forbid(name):
        raise AssertionError(f"the reply holds {name}")

    for action in (
        {"action_type": "emergency_stop"},
        {},
        {"action_type": "control", "throttle": 1},
    ):
        connection.send({"type": "step", "data": action})
        raw = connection.connection.recv(timeout=30)
        reward = json.loads(raw, parse_constant=forbid)["data"]["reward"]
        assert math.isfinite(reward)
