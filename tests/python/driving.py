"""What several tests do with a session of the unmodified client."""

from carla_models import CarlaAction, CarlaEnv

#: Coasting 25 m at 40 km/h takes about 46 steps of 0.05 s.
AFTERMATH_STEPS = 100


def session(base_url):
    """A synchronous session of the unmodified client."""
    return CarlaEnv(base_url=base_url).sync()


def act(env, action_type="observe", **fields):
    return env.step(CarlaAction(action_type=action_type, **fields))


def walkers(observation):
    return [
        actor
        for actor in observation.nearby_actors
        if actor["type"].startswith("walker.pedestrian.")
    ]


def walkers_hit(state):
    """Distinct pedestrians among the collisions of a state."""
    return {hit["actor_id"] for hit in state.collisions if hit["actor_type"].startswith("walker.")}


def free_side(observation):
    """A side with a lane of the same direction, as reset reports it."""
    return observation.metadata["info"]["side_directions"][0]
