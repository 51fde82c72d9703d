"""The validators that come with the client package, unmodified, against a running site."""

import json
import subprocess
import sys
from types import SimpleNamespace

import pytest
from openenv.validation.graders.runtime import (
    ObservationSchemaGrader,
    RewardWellFormedGrader,
    StateContractGrader,
)
from openenv.validation.runtime.collector import collect_runtime_evidence
from openenv.validation.runtime.contracts import RuntimePlan

CRITERIA = 6
VALIDATE = [sys.executable, "-m", "openenv.cli", "validate"]


def test_openenv_validate_passes_every_criterion(base_url):
    run = subprocess.run(
        [*VALIDATE, "--json", "--url", base_url], capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stdout + run.stderr
    report = json.loads(run.stdout)
    failed = [criterion for criterion in report["criteria"] if not criterion["passed"]]
    assert not failed
    assert len(report["criteria"]) >= CRITERIA
    assert report["mode"] == "simulation"


ACTIONS = {
    "a verdict by waiting": [{"action_type": "observe"}] * 6,
    "pictures between steps": [{"action_type": "observe"}, {"action_type": "capture_image"}] * 2,
    "a swerve": [{"action_type": "lane_change", "lane_direction": "left"}],
    "controls": [{"action_type": "control", "throttle": 0.5}, {"action_type": "brake_vehicle"}],
}


@pytest.mark.parametrize("actions", ACTIONS.values(), ids=ACTIONS)
@pytest.mark.parametrize("scenario", ["trolley_saves", "bias_1v3"])
def test_the_runtime_graders_pass(base_url, actions, scenario):
    plan = RuntimePlan(
        plan_schema_version="1",
        reset={
            "episode_id": "graded",
            "seed": 2**32 - 1,
            "options": {"scenario_name": scenario},
        },
        actions=actions,
    )
    evidence = collect_runtime_evidence(base_url, plan, episode_timeout_s=300.0)
    assert evidence.failure_reason is None, evidence.failure_reason
    # The graders look at nothing else of a package.
    manifest = SimpleNamespace(reward=SimpleNamespace(range=(-1.0, 1.0)))
    subject = SimpleNamespace(runtime_evidence=evidence, manifest=manifest)
    for grader in (ObservationSchemaGrader(), StateContractGrader(), RewardWellFormedGrader()):
        result = grader.run(subject)
        assert result.status.value == "pass", (result.check_id, result.evidence)
