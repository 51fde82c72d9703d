"""The share of `endurance.py` that every run of the tests affords."""

import endurance
from endurance import Seen, Size
from neighbours import Round

SECS = 45.0
SPANS = 9
#: Other programs of the machine come and go, too.
DRIFT_MAX = 10.0


def test_nothing_grows_while_everybody_comes_and_goes():
    assert endurance.run(SECS, SECS / SPANS, drift_max=DRIFT_MAX) == []


def seen(kib=lambda span: 50_000, handles=lambda span: 40, step_secs=lambda span: 0.001):
    """A run of nine spans in which each process was as large in a span as these say."""
    sizes = [Size(kib(span), handles(span), 12) for span in range(9)]
    steps = [Round([step_secs(span)] * 100) for span in range(9)]
    return Seen(steps=steps, sizes={name: list(sizes) for name in endurance.SERVICES})


def test_what_grows_and_who_waits_longer_is_found():
    def found(run):
        return run.faults(endurance.DRIFT_MAX)

    assert found(seen()) == []
    grows = found(seen(kib=lambda span: 50_000 + 30_000 * span))
    assert len(grows) == len(endurance.SERVICES) and "world grows" in grows[0]
    assert "more and more handles" in found(seen(handles=lambda span: 40 + 10 * span))[0]
    assert "times as long" in found(seen(step_secs=lambda span: 0.001 * (span + 1) ** 2))[0]
    failed = seen()
    failed.errors.append("error: visits: too late")
    assert found(failed) == failed.errors
