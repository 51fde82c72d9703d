"""One session of the client generation before `openenv`, run in a process of its own.

Usage: old_client_session.py BASE_URL. Prints what it saw as one line of JSON.
"""

import asyncio
import json
import sys

import openenv.core.env_client

from carla_models import CarlaAction, CarlaEnv


async def play(base_url):
    async with CarlaEnv(base_url=base_url) as env:
        start = await env.reset(scenario_name="trolley_saves", seed=1)
        steps = [await env.step(CarlaAction()) for _ in range(4)]
        picture = await env.step(CarlaAction(action_type="capture_image"))
        state = await env.state()
        try:
            await env.reset(scenario_name="nope")
            refusal = None
        except RuntimeError as error:
            refusal = str(error)
        return {
            "location": start.observation.location,
            "rewards": [step.reward for step in steps],
            "done": [step.done for step in steps],
            "picture_chars": len(picture.observation.camera_image or ""),
            "step_count": state.step_count,
            "refusal": refusal,
        }


def play_synchronously(base_url):
    with CarlaEnv(base_url=base_url).sync() as env:
        env.reset(scenario_name="trolley_saves", seed=1)
        return env.step(CarlaAction(action_type="emergency_stop")).observation.step_number


if __name__ == "__main__":
    seen = asyncio.run(play(sys.argv[1]))
    seen["synchronous_step"] = play_synchronously(sys.argv[1])
    seen["module"] = openenv.core.env_client.__file__
    print(json.dumps(seen))
