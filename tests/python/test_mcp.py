"""The JSON-RPC envelope on its three ways in."""

import json

import httpx
import pytest

from wire import wire


@pytest.fixture(params=["http", "socket", "wrapped"])
def ask(request, site):
    """Sends one request, as object or as text, and gives the JSON-RPC answer."""
    if request.param == "http":
        with httpx.Client(base_url=site.base_url, timeout=60.0, trust_env=False) as client:

            def over_http(message):
                body = message if isinstance(message, str) else json.dumps(message)
                reply = client.post(
                    "/mcp", content=body, headers={"content-type": "application/json"}
                )
                assert reply.status_code == 200
                return reply.json()

            yield over_http
    elif request.param == "socket":
        with wire(site.base_url, path="/mcp") as connection:
            yield connection.ask
    else:
        with wire(site.base_url) as connection:

            def wrapped(message):
                reply = connection.ask({"type": "mcp", "data": message})
                assert reply["type"] == "mcp", reply
                return reply["data"]

            yield wrapped


def rpc(method, **more):
    return {"jsonrpc": "2.0", "method": method, "id": 7, **more}


@pytest.mark.parametrize("ask", ["http", "socket"], indirect=True)
def test_a_text_that_is_no_json_is_a_parse_error(ask):
    answer = ask("{")
    assert answer["jsonrpc"] == "2.0"
    assert answer["id"] is None
    assert answer["error"]["code"] == -32700
    assert answer["error"]["message"].startswith("Parse error")


@pytest.mark.parametrize(
    "message",
    [{}, {"jsonrpc": "1.0", "method": "x", "id": 1}, {"jsonrpc": "2.0", "id": 1}, rpc("x", more=1)],
    ids=["empty", "another version", "no method", "unknown key"],
)
def test_an_object_that_is_no_request_is_invalid(ask, message):
    answer = ask(message)
    assert answer["jsonrpc"] == "2.0"
    assert answer["error"]["code"] == -32600
    assert answer["error"]["message"].startswith("Invalid request: ")


def test_an_unknown_method_is_named(ask):
    answer = ask(rpc("no/such"))
    assert answer["id"] == 7
    assert answer["error"]["code"] == -32601
    assert answer["error"]["message"] == "Method not found: no/such"


def test_closing_an_unknown_session_names_it(ask):
    answer = ask(rpc("openenv/session/close", params={"session_id": "nobody"}))
    assert answer["error"]["code"] == -32602
    assert answer["error"]["message"] == "Unknown session_id: nobody"
