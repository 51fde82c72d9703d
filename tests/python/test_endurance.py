"""The share of `endurance.py` that every run of the tests affords."""

import endurance

SECS = 45.0
SPANS = 9
#: Other programs of the machine come and go, too.
DRIFT_MAX = 10.0


def test_nothing_grows_while_everybody_comes_and_goes():
    assert endurance.run(SECS, SECS / SPANS, drift_max=DRIFT_MAX) == []
