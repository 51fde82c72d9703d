"""The benchmark example on its longest tasks."""

import re

from carla_example import run


def test_the_benchmark_navigates_alone_and_among_others(site, client, tmp_path):
    tasks = ("--tasks", "navigation,navigation-dynamic", "--poses", 1)
    ran = run(site, tmp_path, "run_benchmark.py", "-c", "Town02", "--agent", "basic", *tasks)
    assert ran.status == 0, ran.err
    assert re.search(r"navigation: \d+ to \d+, weather 1: arrived after", ran.out), ran.out
    # Others may hold it up.
    assert re.search(r"navigation-dynamic: \d+ to \d+, weather 1: (arrived|\d+ m from)", ran.out)
    assert re.search(r"^ +navigation +1 +100% ", ran.out, re.MULTILINE), ran.out
