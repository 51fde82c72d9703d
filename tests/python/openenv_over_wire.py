"""Plugin of pytest: OpenEnv's own tests of `carla_env`, with a service behind the environment.

What their `CarlaEnvironment` observes and how it is comes over the wire, through OpenEnv's own
client, from the service at CAUSEWAY_URL. Which scenario is set stays upstream's own record, as the
tests look at its fields, of which no client is told.
"""

import os

from carla_env.client import CarlaEnv
from carla_env.server import carla_environment as upstream

#: Tests in which the service was asked for something.
asked: set[str] = set()


class OverTheWire(upstream.CarlaEnvironment):
    """An environment whose world is elsewhere."""

    def __init__(self, scenario_name: str = "trolley_saves", **settings):
        super().__init__(scenario_name=scenario_name, **settings)
        self._name = scenario_name
        self._client = None

    def _service(self):
        asked.add(os.environ["PYTEST_CURRENT_TEST"].split(" ")[0])
        if self._client is None:
            self._client = CarlaEnv(base_url=os.environ["CAUSEWAY_URL"]).sync()
            self._client.connect()
        return self._client

    def reset(self, scenario_name=None, scenario_config=None):
        super().reset(scenario_name=scenario_name, scenario_config=scenario_config)
        self._name = scenario_name or self._name
        config = {"scenario_config": scenario_config} if scenario_config else {}
        return self._service().reset(scenario_name=self._name, **config).observation

    def step(self, action):
        return self._service().step(action).observation

    @property
    def state(self):
        return self._service().state()


upstream.CarlaEnvironment = OverTheWire


def pytest_terminal_summary(terminalreporter):
    terminalreporter.write_line(f"{len(asked)} tests asked the service")
