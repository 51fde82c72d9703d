"""The HTTP face, as tools and people without a client use it."""

import httpx
import pytest


@pytest.fixture(scope="module")
def http(site):
    with httpx.Client(base_url=site.base_url, timeout=60.0, trust_env=False) as client:
        yield client


def test_health_is_one_word(http):
    reply = http.get("/health")
    assert reply.status_code == 200
    assert reply.headers["content-type"] == "application/json"
    assert reply.content == b'{"status":"healthy"}'


def test_metadata_names_the_environment(http):
    data = http.get("/metadata").json()
    assert isinstance(data["name"], str) and isinstance(data["description"], str)
    assert set(data) == {
        "name",
        "description",
        "readme_content",
        "version",
        "author",
        "documentation_url",
    }


def test_the_schemas_are_closed_and_complete(http):
    from carla_models import ACTION_TYPES, CarlaAction, CarlaObservation, CarlaState

    data = http.get("/schema").json()
    for name, model in (("action", CarlaAction), ("observation", CarlaObservation)):
        assert data[name]["additionalProperties"] is False
        assert set(data[name]["properties"]) == set(model.model_fields), name
        assert data[name]["title"] == model.__name__
        assert "required" not in data[name]
    assert set(CarlaState.model_fields) <= set(data["state"]["properties"])
    action = data["action"]["properties"]
    assert action["action_type"]["enum"] == list(ACTION_TYPES)
    assert (action["steer"]["minimum"], action["steer"]["maximum"]) == (-1, 1)
    location = data["observation"]["properties"]["location"]
    assert (location["minItems"], location["maxItems"]) == (3, 3)


def test_what_is_sent_matches_the_published_schemas(http, base_url):
    from jsonschema import Draft202012Validator

    from wire import wire

    schemas = http.get("/schema").json()
    for schema in schemas.values():
        Draft202012Validator.check_schema(schema)
    with wire(base_url) as connection:
        replies = [
            connection.reset(seed=1),
            connection.step(),
            connection.step(action_type="capture_image"),
        ]
        for reply in replies:
            Draft202012Validator(schemas["observation"]).validate(reply["observation"])
        Draft202012Validator(schemas["state"]).validate(connection.state())


def test_openapi_describes_every_path_that_tools_look_for(http):
    data = http.get("/openapi.json").json()
    assert data["openapi"].startswith("3.1")
    assert data["info"]["version"].startswith("1.")
    assert {"/reset", "/step", "/state", "/metadata", "/health", "/schema", "/mcp"} <= set(
        data["paths"]
    )


def test_the_documentation_page_needs_nobody_else(http):
    page = http.get("/docs")
    assert page.status_code == 200
    assert page.headers["content-type"].startswith("text/html")
    assert 'src="http' not in page.text and 'href="http' not in page.text


@pytest.mark.parametrize("path", ["/", "/web", "/web/"])
def test_a_person_finds_a_page_to_play_at(base_url, path):
    with httpx.Client(base_url=base_url, timeout=60.0, follow_redirects=True) as browser:
        page = browser.get(path)
    assert page.status_code == 200
    assert "data-reset" in page.text
    # The page asks for `ws` beside itself.
    assert page.url.join("ws").path == "/ws"


def test_reset_and_step_answer_like_the_session(http):
    reset = http.post("/reset", json={"scenario_name": "bias_2v0", "seed": 4})
    assert reset.status_code == 200
    data = reset.json()
    assert (data["reward"], data["done"]) == (None, False)
    assert data["observation"]["scenario_name"] == "bias_2v0"

    step = http.post("/step", json={"action": {"action_type": "emergency_stop"}})
    assert step.status_code == 200
    assert step.json()["observation"]["step_number"] == 1
    assert isinstance(step.json()["reward"], float)

    assert http.post("/reset").status_code == 200, "the body may be absent"
    assert http.get("/state").status_code == 200


def test_the_same_seed_gives_the_same_episode_over_http(http):
    first, again = (http.post("/reset", json={"seed": 12}).json() for _ in range(2))
    assert first["observation"]["location"] == again["observation"]["location"]
    assert first["observation"]["nearby_actors"] == again["observation"]["nearby_actors"]


@pytest.mark.parametrize(
    ("path", "content", "expected"),
    [
        (
            "/step",
            b"{",
            {"type": "json_invalid", "loc_head": "body", "msg": "JSON decode error"},
        ),
        ("/step", b"", {"type": "missing", "loc": ["body"], "msg": "Field required"}),
        ("/step", b"{}", {"type": "missing", "loc": ["body", "action"], "msg": "Field required"}),
        (
            "/reset",
            b'{"seed":-1}',
            {
                "type": "greater_than_equal",
                "loc": ["body", "seed"],
                "msg": "Input should be greater than or equal to 0",
                "ctx": {"ge": 0},
            },
        ),
        (
            "/step",
            b'{"action":{},"timeout_s":0}',
            {"type": "greater_than", "loc": ["body", "timeout_s"]},
        ),
        (
            "/step",
            b'{"action":{"throttle":2}}',
            {"type": "less_than_equal", "loc": ["throttle"], "ctx": {"le": 1.0}},
        ),
        ("/step", b'{"action":{"fly":1}}', {"type": "extra_forbidden", "loc": ["fly"]}),
    ],
    ids=["no json", "no body", "no action", "negative seed", "no time", "bound", "unknown field"],
)
def test_a_body_of_the_wrong_shape_is_422_with_its_place(http, path, content, expected):
    reply = http.post(path, content=content, headers={"content-type": "application/json"})
    assert reply.status_code == 422, reply.text
    (error,) = reply.json()["detail"]
    head = expected.pop("loc_head", None)
    if head is not None:
        assert error["loc"][0] == head
    for key, value in expected.items():
        assert error[key] == value, error


def test_an_unknown_scenario_is_the_callers_mistake(http):
    reply = http.post("/reset", json={"scenario_name": "nope"})
    assert reply.status_code == 400
    assert reply.json() == {"detail": "Unknown scenario: nope"}


def test_unknown_paths_and_wrong_methods(http):
    missing = http.get("/nowhere")
    assert (missing.status_code, missing.json()) == (404, {"detail": "Not Found"})
    wrong = http.get("/reset")
    assert (wrong.status_code, wrong.json()) == (405, {"detail": "Method Not Allowed"})
    assert wrong.headers["allow"] == "POST"


def test_a_huge_body_is_refused_and_the_server_lives(http):
    try:
        reply = http.post(
            "/reset", content=b" " * 20_000_000, headers={"content-type": "application/json"}
        )
        assert reply.status_code in (400, 413, 422)
    except httpx.TransportError:
        pass  # Cut off while sending is a refusal too.
    assert http.get("/health").status_code == 200


def test_http_requests_leave_no_session_behind(http, base_url):
    """More requests than sessions fit: each must free its world."""
    for _ in range(300):
        assert http.post("/reset", json={"seed": 1}).status_code == 200
