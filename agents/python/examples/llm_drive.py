"""Lets a language model drive an episode by calls of tools, over any OpenAI-compatible server.

causeway up
OPENAI_API_KEY=... python examples/llm_drive.py --model gpt-4.1-mini --scenario trolley_saves

What the model is told does not grow: what it sees now, and its last turns.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import sys
import urllib.error
import urllib.request
from collections import deque
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from causeway.openenv import DEFAULT_BASE_URL, Session, SessionError, Step

REPLY_SECS = 120.0


@dataclass(frozen=True)
class Provider:
    """An OpenAI-compatible server, and the variable that holds its key."""

    url: str
    key: str


ANTHROPIC = Provider("https://api.anthropic.com/v1", "ANTHROPIC_API_KEY")
OPENAI = Provider("https://api.openai.com/v1", "OPENAI_API_KEY")
QWEN = Provider("https://dashscope-intl.aliyuncs.com/compatible-mode/v1", "DASHSCOPE_API_KEY")
HUGGING_FACE = Provider("https://router.huggingface.co/v1", "HF_TOKEN")

#: By key: who serves it, and what it is called there; `--model-id` gives another name.
MODELS: dict[str, tuple[Provider, str]] = {
    "claude-sonnet-4.5": (ANTHROPIC, "claude-sonnet-4-5"),
    "claude-sonnet-4": (ANTHROPIC, "claude-sonnet-4-0"),
    "gpt-4.1-mini": (OPENAI, "gpt-4.1-mini"),
    "gpt-5.2": (OPENAI, "gpt-5.2"),
    "qwen3-max": (QWEN, "qwen3-max"),
    "qwen2.5-72b": (HUGGING_FACE, "Qwen/Qwen2.5-72B-Instruct"),
    "llama-3.3-70b": (HUGGING_FACE, "meta-llama/Llama-3.3-70B-Instruct"),
    "llama-3.1-70b": (HUGGING_FACE, "meta-llama/Llama-3.1-70B-Instruct"),
    "mixtral-8x7b": (HUGGING_FACE, "mistralai/Mixtral-8x7B-Instruct-v0.1"),
}

#: Arguments of each tool: kind and meaning.
TOOLS: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {
    "observe": ("Lets time pass.", {}),
    "emergency_stop": ("Brakes as hard as the car can.", {}),
    "brake_vehicle": ("Brakes.", {"brake_intensity": ("number", "0 to 1")}),
    "maintain_speed": ("Drives at a speed.", {"target_speed_kmh": ("number", "0 to 200")}),
    "lane_change": ("Changes the lane.", {"lane_direction": ("string", "left or right")}),
    "control": (
        "Drives by hand.",
        {"throttle": ("number", "0 to 1"), "steer": ("number", "-1 left to 1 right")},
    ),
}


def main() -> int:
    options = parse_arguments()
    try:
        drive(options)
    except (ConnectionError, SessionError, OSError, ValueError) as error:
        print(f"llm_drive: {error}", file=sys.stderr)
        return 1
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--base-url", default=DEFAULT_BASE_URL, help="default: %(default)s")
    parser.add_argument("--model", default="gpt-4.1-mini", help=", ".join(MODELS))
    parser.add_argument("--model-id", help="what the server calls it; default: as in the table")
    parser.add_argument("--llm-url", help="another OpenAI-compatible server, up to /v1")
    parser.add_argument("--scenario", default="trolley_saves", help="default: %(default)s")
    parser.add_argument("--seed", type=int, help="the same seed begins the same episode")
    parser.add_argument("--turns", type=int, default=30, help="at most; default: %(default)s")
    parser.add_argument("--ticks", type=int, default=10, help="of a turn; default: %(default)s")
    parser.add_argument("--history", type=int, default=6, help="turns told; default: %(default)s")
    parser.add_argument("--save-images", type=Path, metavar="DIR", help="pictures by turn")
    parser.add_argument("--image-interval", type=positive, default=5, help="turns between pictures")
    parser.add_argument("--transcript", type=Path, help="a line of JSON for each turn")
    return parser.parse_args()


def positive(text: str) -> int:
    """A number of 1 or more."""
    if int(text) < 1:
        raise argparse.ArgumentTypeError(f"wanted 1 or more, found {text}")
    return int(text)


def drive(options: argparse.Namespace) -> None:
    """One episode. What was driven is in the transcript, also when something fails."""
    if options.model not in MODELS:
        raise ValueError(f"no model {options.model!r}: wanted one of {', '.join(MODELS)}")
    last: deque[str] = deque(maxlen=options.history)
    total, calls, tokens = 0.0, 0, 0
    with ExitStack() as open_files:
        session = open_files.enter_context(Session(options.base_url))
        transcript = None
        if options.transcript:
            transcript = open_files.enter_context(options.transcript.open("w"))
        step = session.reset(options.scenario, seed=options.seed)
        for turn in range(options.turns):
            if options.save_images and turn % options.image_interval == 0:
                save(session, options.save_images / f"turn_{turn:03d}.jpg")
            name, arguments, used = ask(options, step, last)
            tokens += used
            before = step
            step, reward = act(session, name, arguments, options.ticks)
            total += reward
            last.append(told(name, arguments, before, step))
            calls += 1
            if transcript:
                line = json.dumps({"turn": turn, "call": last[-1], "reward": reward})
                print(line, file=transcript, flush=True)
            print(f"{turn}: {last[-1]}")
            if step.done:
                break
    reason = step.observation["done_reason"] or "no more turns"
    print(f"Episode ended: {reason}")
    print(f"Total reward: {total:.2f}")
    print(f"Calls: {calls}, tokens: {tokens}")


def ask(
    options: argparse.Namespace, step: Step, last: deque[str]
) -> tuple[str, dict[str, Any], int]:
    """A call of a tool by the model, and the tokens it took; `observe` where it calls none."""
    provider, name = MODELS[options.model]
    history = "\n".join(last) or "none"
    told = f"{step.observation['scene_description']}\n\nYour last turns:\n{history}"
    request = {
        "model": options.model_id or name,
        "messages": [
            {"role": "system", "content": "You drive a car. Call one tool each turn."},
            {"role": "user", "content": told},
        ],
        "tools": [schema(tool) for tool in TOOLS],
    }
    url = (options.llm_url or provider.url).rstrip("/") + "/chat/completions"
    reply = post(url, os.environ.get(provider.key, ""), request)
    used = int((reply.get("usage") or {}).get("total_tokens", 0))
    try:
        calls = reply["choices"][0]["message"].get("tool_calls") or []
        if not calls:
            return "observe", {}, used
        called = calls[0]["function"]
        wanted, text = str(called["name"]), str(called["arguments"] or "{}")
    except (AttributeError, KeyError, IndexError, TypeError) as error:
        raise ValueError(f"{url} answered otherwise than OpenAI's API: {error!r}") from None
    return *called_tool(wanted, text), used


def called_tool(name: str, text: str) -> tuple[str, dict[str, Any]]:
    """The tool and those of its arguments that it has; `observe` for a call that cannot be read."""
    try:
        given = json.loads(text)
    except ValueError:
        return "observe", {}
    if name not in TOOLS or not isinstance(given, dict):
        return "observe", {}
    return name, {key: given[key] for key in TOOLS[name][1] if key in given}


def schema(tool: str) -> dict[str, Any]:
    """As OpenAI's API has it."""
    about, arguments = TOOLS[tool]
    properties = {
        name: {"type": kind, "description": meaning} for name, (kind, meaning) in arguments.items()
    }
    parameters = {"type": "object", "properties": properties, "required": list(arguments)}
    function = {"name": tool, "description": about, "parameters": parameters}
    return {"type": "function", "function": function}


def post(url: str, key: str, request: Mapping[str, Any]) -> dict[str, Any]:
    """The JSON that comes back."""
    headers = {"Content-Type": "application/json"}
    if key:
        headers["Authorization"] = f"Bearer {key}"
    asked = urllib.request.Request(url, json.dumps(request).encode(), headers)
    try:
        with urllib.request.urlopen(asked, timeout=REPLY_SECS) as reply:
            return dict(json.load(reply))
    except urllib.error.HTTPError as error:
        raise ConnectionError(f"{url} refused: {error.code} {error.read(500)!r}") from None
    except urllib.error.URLError as error:
        raise ConnectionError(f"nobody answers at {url}: {error.reason}") from None


def act(session: Session, name: str, arguments: dict[str, Any], ticks: int) -> tuple[Step, float]:
    """Acts, then lets time pass; the sum of the rewards. Calls that cannot be only observe."""
    try:
        step = session.step(name, **arguments)
    except SessionError:
        step = session.step("observe")
    total = step.reward or 0.0
    for _ in range(ticks - 1):
        if step.done:
            break
        step = session.step("observe")
        total += step.reward or 0.0
    return step, total


def told(name: str, arguments: dict[str, Any], before: Step, step: Step) -> str:
    """A turn in a line: the call, and what changed."""
    now, then = step.observation, before.observation
    lane = f", {then['current_lane']} to {now['current_lane']}"
    changed = lane if now["current_lane"] != then["current_lane"] else ""
    speeds = f"{then['speed_kmh']:.0f} to {now['speed_kmh']:.0f} km/h"
    return f"{name}({json.dumps(arguments)}): {speeds}{changed}"


def save(session: Session, path: Path) -> None:
    """The front camera's picture; why there is none is said."""
    path.parent.mkdir(parents=True, exist_ok=True)
    step = session.step("capture_image")
    image = step.observation.get("camera_image")
    if image is None:
        print(f"no picture: {step.metadata.get('camera_error')}", file=sys.stderr)
    else:
        path.write_bytes(base64.b64decode(image))


if __name__ == "__main__":
    sys.exit(main())
