"""The loop of a language model that drives, beside a stand-in that answers as OpenAI does."""

import json
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from test_examples import run

BRAKE = {"name": "emergency_stop", "arguments": "{}"}


@contextmanager
def model(answers):
    """A server that answers with these calls in turn, then with the last; and what it was asked."""
    asked = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            asked.append((self.path, self.headers.get("Authorization"), request))
            answer = answers[min(len(asked), len(answers)) - 1]
            message = {"role": "assistant", "content": None}
            if isinstance(answer, dict):
                message["tool_calls"] = [{"id": "1", "type": "function", "function": answer}]
            reply = {"choices": [{"message": message}], "usage": {"total_tokens": 100}}
            body = json.dumps(reply if answer != "nonsense" else {"error": "no"}).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/v1", asked
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def drive(base_url, llm_url, *arguments):
    own = ("--base-url", base_url, "--llm-url", llm_url, "--seed", 1)
    return run("llm_drive.py", *own, *arguments)


def test_the_model_drives_until_the_episode_is_over(base_url, tmp_path):
    observe = {"name": "observe", "arguments": "{}"}
    with model([observe, BRAKE]) as (url, asked):
        transcript = tmp_path / "turns.jsonl"
        done = drive(base_url, url, "--ticks", 1, "--history", 1, "--transcript", transcript)
    assert done.returncode == 0, done.stderr
    assert "Episode ended: " in done.stdout and "Total reward: " in done.stdout
    turns = [json.loads(line) for line in transcript.read_text().splitlines()]
    assert len(turns) == len(asked) and f"tokens: {100 * len(asked)}" in done.stdout
    path, _, request = asked[-1]
    assert path == "/v1/chat/completions" and request["model"] == "gpt-4.1-mini"
    assert len(request["messages"]) == 2, "what the model is told does not grow"
    history = request["messages"][1]["content"].split("Your last turns:\n")[1].splitlines()
    assert len(turns) > 2 and history == [turns[-2]["call"]]
    assert {tool["function"]["name"] for tool in request["tools"]} >= {"observe", "lane_change"}


def test_calls_that_cannot_be_let_time_pass(base_url):
    wrong = [
        {"name": "fly", "arguments": "{}"},
        {"name": "brake_vehicle", "arguments": '{"brake_intensity": 7}'},
        {"name": "observe", "arguments": '{"brake_intensity":'},
        {"name": "observe", "arguments": '{"metadata": {"op": "snapshot"}}'},
    ]
    with model(wrong) as (url, asked):
        done = drive(base_url, url, "--turns", 4, "--ticks", 1)
    assert done.returncode == 0, done.stderr
    assert len(asked) == 4 and "Episode ended" in done.stdout
    assert "metadata" not in done.stdout, "a driver reaches nothing but its tools"


def test_turns_before_an_error_are_in_the_transcript(base_url, tmp_path):
    transcript = tmp_path / "turns.jsonl"
    observe = {"name": "observe", "arguments": "{}"}
    with model([observe, observe, "nonsense"]) as (url, _):
        done = drive(base_url, url, "--ticks", 1, "--transcript", transcript)
    assert done.returncode == 1
    assert len(transcript.read_text().splitlines()) == 2
    refused = drive(base_url, "http://127.0.0.1:1", "--image-interval", 0)
    assert refused.returncode == 2 and "1 or more" in refused.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(("--model", "hal-9000"), "claude-sonnet-4.5"), ((), "otherwise than OpenAI's API")],
)
def test_what_cannot_be_is_said(base_url, arguments, words):
    with model(["nonsense"]) as (url, _):
        done = drive(base_url, url, *arguments)
    assert done.returncode == 1 and words in done.stderr
