"""The share of `endurance.py` that every run of the tests affords."""

import time

import endurance
from endurance import Seen, Size
from neighbours import Neighbours, Round

SECS = 45.0
SPANS = 9
HOSTILE_SECS = 25.0
PATIENCE_SECS = 90.0
#: A step waits for a world service that was killed, on a machine that is full.
STEP_SECS_MAX = 30.0
#: Other programs of the machine come and go, too.
DRIFT_MAX = 10.0


def test_nothing_grows_while_everybody_comes_and_goes():
    assert endurance.run(SECS, SECS / SPANS, drift_max=DRIFT_MAX) == []


def test_an_honest_client_has_no_error_beside_everything_hostile_at_once(start_site):
    """`endurance.py --hostile` for a moment; it is that which tells how long steps take."""
    ports = endurance.ports_of_endpoints(3)
    site, run = start_site("--carla", ",".join(map(str, ports))), Seen()
    kinds = (*endurance.HOSTILE_CHURN, "floods")
    with Neighbours(site.base_url, 1) as honest:
        with endurance.hostile(site, run, ports[1:], 0):
            beside = honest.look(HOSTILE_SECS)
            # A busy machine takes long until all of their processes are up.
            deadline = time.monotonic() + PATIENCE_SECS
            while any(run.done[kind] == 0 for kind in kinds) and time.monotonic() < deadline:
                time.sleep(0.5)
        time.sleep(1.0)
        quiet = honest.look(3.0)
    print(f"beside: {beside}; then {quiet}; {dict(run.done)}; {run.errors_of_visitors()}")
    assert max(beside.steps_secs) < STEP_SECS_MAX
    for kind in kinds:
        assert run.done[kind] > 0, (kind, run.errors)
    endurance.sizes_of(site)


def seen(kib=lambda span: 50_000, handles=lambda span: 40, step_secs=lambda span: 0.001):
    """A run of nine spans in which each process was as large in a span as these say."""
    sizes = [Size(kib(span), handles(span), 12) for span in range(9)]
    steps = [Round([step_secs(span)] * 100) for span in range(9)]
    return Seen(steps=steps, sizes={name: list(sizes) for name in endurance.PROCESSES})


def test_what_grows_and_who_waits_longer_is_found():
    def found(run):
        return run.faults(endurance.DRIFT_MAX)

    assert found(seen()) == []
    grows = found(seen(kib=lambda span: 50_000 + 30_000 * span))
    assert len(grows) == len(endurance.PROCESSES) and "up grows" in grows[0]
    assert "more and more handles" in found(seen(handles=lambda span: 40 + 10 * span))[0]
    assert "times as long" in found(seen(step_secs=lambda span: 0.001 * (span + 1) ** 2))[0]
    failed = seen()
    failed.errors.append("error: visits: too late")
    assert found(failed) == failed.errors
