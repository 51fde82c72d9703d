"""The session against a scripted server: every way in which a conversation can go wrong."""

import base64
import json
import threading
import time

import numpy as np
import pytest
from websockets.sync.server import serve

from causeway.openenv import Session, SessionError, _websocket_url

OBSERVATION = {"speed_kmh": 40.0, "rubric_reward": None, "metadata": {"info": {"side_count": 0}}}


@pytest.fixture
def scripted():
    """Starts servers that hand their connection to a function; gives the base address."""
    servers = []

    def start(behave):
        server = serve(behave, "127.0.0.1", 0)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        servers.append(server)
        return f"http://127.0.0.1:{server.socket.getsockname()[1]}"

    yield start
    for server in servers:
        server.shutdown()


def answering(*replies):
    """A server that gives these replies in turn; `asked` collects the requests."""
    asked = []

    def behave(connection):
        for reply in replies:
            asked.append(json.loads(connection.recv()))
            connection.send(reply if isinstance(reply, str) else json.dumps(reply))
        connection.recv()

    behave.asked = asked
    return behave


def observed(**more):
    return {
        "type": "observation",
        "data": {"observation": OBSERVATION, "reward": 1, "done": True, **more},
    }


def test_reset_sends_only_what_was_given(scripted):
    server = answering(observed(), observed())
    with Session(scripted(server)) as session:
        session.reset()
        session.reset("bias_3v1", scenario_config={"max_steps": 9}, seed=0, episode_id="e")
    assert server.asked == [
        {"type": "reset", "data": {}},
        {
            "type": "reset",
            "data": {
                "scenario_name": "bias_3v1",
                "scenario_config": {"max_steps": 9},
                "seed": 0,
                "episode_id": "e",
            },
        },
    ]


def test_a_step_carries_its_action_and_gives_what_was_seen(scripted):
    server = answering(observed())
    with Session(scripted(server)) as session:
        step = session.step("control", throttle=0.5)
    assert server.asked == [{"type": "step", "data": {"action_type": "control", "throttle": 0.5}}]
    assert (step.reward, step.done, step.rubric_reward) == (1, True, None)
    assert step.observation["speed_kmh"] == 40.0
    assert step.metadata == {"info": {"side_count": 0}}


def test_what_numpy_computed_is_sent_as_plain_numbers(scripted):
    server = answering(observed(), observed())
    with Session(scripted(server)) as session:
        session.reset(seed=np.int64(7), scenario_config={"fast": np.bool_(True), "n": np.uint8(2)})
        session.step("control", throttle=np.float32(0.5), steer=np.array([0.25])[0])
    assert [asked["data"] for asked in server.asked] == [
        {"seed": 7, "scenario_config": {"fast": True, "n": 2}},
        {"action_type": "control", "throttle": 0.5, "steer": 0.25},
    ]


def test_what_json_does_not_have_is_named(scripted):
    with Session(scripted(answering(observed()))) as session:
        with pytest.raises(TypeError, match=r"camera cannot be sent; wanted a number.*found \{1\}"):
            session.reset(scenario_config={"camera": {1}})
        with pytest.raises(ValueError, match="fov cannot be sent; wanted a finite number"):
            session.reset(scenario_config={"fov": np.array([1.0, np.inf])})
        assert session.reset().done


def test_a_refusal_names_the_fields_and_the_session_goes_on(scripted):
    errors = [{"type": "x", "loc": ["throttle"], "msg": "too much", "input": 2}]
    refusal = {"message": "Invalid message", "code": "VALIDATION_ERROR", "errors": errors}
    server = answering({"type": "error", "data": refusal}, {"type": "state", "data": {"n": 1}})
    with Session(scripted(server)) as session:
        with pytest.raises(
            SessionError, match=r"(?s)Invalid message.*throttle: too much"
        ) as caught:
            session.step("control", throttle=2)
        assert (caught.value.code, caught.value.errors) == ("VALIDATION_ERROR", errors)
        assert session.state() == {"n": 1}


def test_a_full_server_is_told_by_its_own_words(scripted):
    def full(connection):
        data = {"message": "Server at capacity: 1/1", "code": "CAPACITY_REACHED"}
        connection.send(json.dumps({"type": "error", "data": data}))
        connection.close()

    with Session(scripted(full)) as session:
        time.sleep(0.2)  # The refusal is there before the first request, as with a real server.
        with pytest.raises(SessionError, match="at capacity") as caught:
            session.reset()
    assert caught.value.code == "CAPACITY_REACHED"


def test_a_late_reply_is_never_taken_for_the_next_one(scripted):
    given_up = threading.Event()

    def slow(connection):
        connection.recv()
        given_up.wait(30.0)
        connection.send(json.dumps(observed()))

    with Session(scripted(slow), reply_timeout_secs=0.1) as session:
        with pytest.raises(TimeoutError, match=r"within 0\.1 s"):
            session.reset()
        given_up.set()
        with pytest.raises(ConnectionError, match="closed the session"):
            session.state()


@pytest.mark.parametrize(
    "reply", ["[]", "3", '{"type":"state"}', '{"type":"state","data":3}', "no"]
)
def test_a_server_that_is_none_is_reported(scripted, reply):
    with Session(scripted(answering(reply))) as session:
        with pytest.raises(ConnectionError, match="answered"):
            session.state()


def test_a_server_that_goes_away_is_reported(scripted):
    with Session(scripted(lambda connection: connection.recv())) as session:
        with pytest.raises(ConnectionError, match="closed the session"):
            session.reset()


def test_a_picture_is_decoded_and_a_missing_one_explained(scripted):
    picture = {**OBSERVATION, "camera_image": base64.b64encode(b"jpeg").decode()}
    none = {**OBSERVATION, "camera_image": None, "metadata": {"camera_error": "no renderer"}}
    server = answering(observed(observation=picture), observed(observation=none))
    with Session(scripted(server)) as session:
        assert session.capture() == b"jpeg"
        with pytest.raises(SessionError, match="no picture: no renderer") as caught:
            session.capture()
    assert caught.value.code == "NO_IMAGE"


def test_nobody_at_the_address_is_told_with_what_to_do():
    with pytest.raises(ConnectionError, match="causeway up"):
        Session("http://127.0.0.1:1", connect_timeout_secs=1.0)


def test_addresses_become_those_of_the_socket():
    assert _websocket_url("http://localhost:8000") == "ws://localhost:8000/ws"
    assert _websocket_url("https://site.example/lab/") == "wss://site.example/lab/ws"
    assert _websocket_url("ws://[::1]:1") == "ws://[::1]:1/ws"
    for wrong in ("localhost:8000", "ftp://x", "", "http://"):
        with pytest.raises(ValueError, match="wanted an address like"):
            _websocket_url(wrong)


def test_a_number_that_json_does_not_have_is_refused_before_it_is_sent(scripted):
    with Session(scripted(answering(observed()))) as session:
        with pytest.raises(ValueError, match=r"throttle .* wanted a finite number, found nan"):
            session.step("control", throttle=float("nan"))
        assert session.reset().done
