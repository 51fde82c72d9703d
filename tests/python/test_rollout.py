"""Batches of worlds in shared memory: what they promise, and what bad input does."""

import contextlib
import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from causeway.rollout import Batch, EngineError

from running_site import PACKAGE, binary

#: A busy machine gets so long for what takes milliseconds.
DEADLINE_SECS = 60.0


@pytest.fixture
def batch(tmp_path):
    """Opens batches that are closed after the test."""
    with contextlib.ExitStack() as stack:

        def another(task="lane-keep", **settings):
            settings = {"town": "Town02", "program": str(binary()), **settings}
            return stack.enter_context(Batch(task, **settings))

        yield another


@pytest.fixture
def listening(tmp_path):
    """A running `causeway rollout --listen`, and its socket."""
    path = tmp_path / "rollout.sock"
    process = subprocess.Popen([binary(), "rollout", "--listen", path], stderr=subprocess.PIPE)
    deadline = time.monotonic() + DEADLINE_SECS
    while not path.exists():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.02)
    yield process, path
    process.kill()
    process.wait()


def drive(batch, steps, seed=0):
    """Random actions with much throttle; copies of all that came of them."""
    random = np.random.default_rng(seed)
    seen = []
    for _ in range(steps):
        actions = random.uniform(-0.3, 1.0, (batch.rows, 2)).astype(np.float32)
        actions[:, 0] *= 0.2
        seen.append([array.copy() for array in batch.step(actions)] + [batch.hashes.copy()])
    return seen


def equal(one, other):
    return all(
        np.array_equal(a, b)
        for ours, theirs in zip(one, other, strict=True)
        for a, b in zip(ours, theirs, strict=True)
    )


def test_rows_have_the_columns_that_the_batch_names(batch):
    batch = batch(worlds=3, normalise=False)
    assert batch.observations.shape == (3, 46) == (batch.rows, batch.width)
    names = [column.name for column in batch.columns]
    assert names[0] == "ego.speed" and names[-1] == "goal.distance"
    speeds = batch.observations[:, 0]
    assert ((speeds >= 0.0) & (speeds <= 10.5)).all() and speeds.max() > 0.5
    observations, rewards, terminated, truncated = batch.step(np.tile([[0.0, 1.0]], (3, 1)))
    assert (observations[:, names.index("ego.last.pedal")] == 1.0).all()
    assert rewards.dtype == np.float32 and terminated.dtype == truncated.dtype == np.bool_
    assert (rewards > 0.0).all() and (batch.ticks == 2).all() and batch.alive.all()


@pytest.mark.parametrize("other", [{"threads": 2}, {"threads": 4}, {"slots": 4}])
def test_equal_seeds_and_actions_give_equal_bytes(batch, other):
    settings = {"worlds": 8, "seed": 3, "hash_every": 1}
    first, second = batch(threads=1, **settings), batch(**settings, **other)
    assert equal(drive(first, 150), drive(second, 150))


def test_a_world_is_the_same_among_few_and_among_many(batch, listening):
    many = batch(worlds=6, threads=2, hash_every=1)
    few = batch(worlds=2, threads=1, hash_every=1, address=listening[1])
    for _ in range(100):
        actions = np.tile(np.array([[0.02, 0.6]], np.float32), (6, 1))
        ours, theirs = many.step(actions), few.step(actions[:2])
        assert all(np.array_equal(a[:2], b) for a, b in zip(ours, theirs, strict=True))
        assert np.array_equal(many.hashes[:2], few.hashes)


def test_a_reset_by_seed_repeats_and_a_mask_leaves_the_others_alone(batch):
    batch = batch(worlds=4, town="Town02")
    first = batch.reset(seed=[7, 8, 7, None]).copy()
    assert np.array_equal(first[0], first[2]) and not np.array_equal(first[0], first[1])
    drive(batch, 5)
    before = batch.observations.copy()
    after = batch.reset(seed=[None, 7, None, None], mask=np.array([False, True, False, False]))
    assert np.array_equal(after[1], first[0])
    assert np.array_equal(after[[0, 2, 3]], before[[0, 2, 3]])


def test_views_are_of_slots_that_take_turns(batch):
    batch = batch(worlds=2, slots=2)
    actions = np.full((2, 2), 0.5, np.float32)
    view = batch.step(actions)[0]
    copy = view.copy()
    batch.step(actions)
    assert np.array_equal(view, copy), "still there after one step"
    batch.step(actions)
    assert not np.array_equal(view, copy), "written again by the second"
    assert not view.flags.owndata


def test_forks_go_on_as_their_origin_until_their_own_actions_differ(batch):
    batch = batch(worlds=64, threads=2)
    drive(batch, 10)
    batch.fork(0, range(1, 64))
    for number in range(500):
        steer = 0.02 * np.sin(number / 20)
        observations, *_ = batch.step(np.tile(np.array([[steer, 0.3]], np.float32), (64, 1)))
        assert (observations == observations[0]).all(), number
        assert (batch.seeds == batch.seeds[0]).all()
    kept = batch.snapshot([0])
    batch.restore(kept * 64, range(64))
    actions = np.tile(np.array([[0.0, 0.3]], np.float32), (64, 1))
    actions[40, 0] = 0.5
    for _ in range(4):
        observations, *_ = batch.step(actions)
    differs = (observations != observations[0]).any(axis=1)
    assert np.flatnonzero(differs).tolist() == [40]
    batch.fork(0, range(1, 64), reseed=True)
    assert len(set(batch.reset()[:, 0].tolist())) >= 1
    assert len(set(batch.seeds.tolist())) == 64
    batch.forget(kept)
    with pytest.raises(ValueError, match="no such snapshot"):
        batch.restore(kept, [0])


def test_actions_that_are_none_are_refused_and_nothing_is_stepped(batch):
    batch = batch(worlds=4, threads=2)
    good = np.zeros((4, 2), np.float32)
    batch.step(good)
    before, ticks = batch.observations.copy(), batch.ticks.copy()
    with pytest.raises(ValueError, match=r"wanted \(4, 2\), found \(3, 2\)"):
        batch.step(good[:3])
    with pytest.raises(ValueError, match="shape"):
        batch.step(good.ravel())
    with pytest.raises(TypeError, match="wanted floats, found int64"):
        batch.step(np.zeros((4, 2), np.int64))
    bad = good.copy()
    bad[2, 1] = np.nan
    with pytest.raises(ValueError, match=r"no number.*finite.*NaN"):
        batch.step(bad)
    assert np.array_equal(batch.observations, before)
    batch.step(good)
    assert (batch.ticks == ticks + 2).all()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"task": "fly"}, "no such task.*corl17-straight.*fly"),
        ({"town": "Atlantis"}, "no such map.*Town02.*Atlantis"),
        ({"agents": 300}, "agents is out of range; wanted 1 to 256, found 300"),
        ({"agents": 250}, "not so many starts; wanted at most"),
        ({"reward": {"fame": 1.0}}, "no such term.*progress.*fame"),
        ({"ends": ["boredom"]}, "boredom.*arrived"),
        ({"slots": 1}, "slots are out of range; wanted 2 to 4"),
        ({"observation": "smell"}, "smell.*route"),
    ],
)
def test_settings_that_cannot_be_say_what_was_wanted(batch, settings, words):
    with pytest.raises(ValueError, match=words):
        batch(**settings)


def test_a_step_under_way_is_taken_first(batch):
    batch = batch(worlds=2)
    actions = np.zeros((2, 2), np.float32)
    batch.send(actions)
    with pytest.raises(RuntimeError, match="recv"):
        batch.send(actions)
    with pytest.raises(RuntimeError, match="recv"):
        batch.reset()
    assert batch.recv()[0].shape == (2, 46)
    with pytest.raises(RuntimeError, match="send"):
        batch.recv()


def test_without_autoreset_an_episode_that_is_over_waits_for_its_reset(batch):
    batch = batch(worlds=2, autoreset="disabled", horizon_secs=1.0)
    actions = np.zeros((2, 2), np.float32)
    for _ in range(10):
        truncated = batch.step(actions)[3]
    assert truncated.all()
    with pytest.raises(ValueError, match=r"is over.*reset"):
        batch.step(actions)
    batch.reset(mask=np.array([True, True]))
    batch.step(actions)


def test_an_engine_that_is_killed_is_named_at_once(batch):
    batch = batch(worlds=16)
    engine = batch._engine._process.pid
    actions = np.zeros((16, 2), np.float32)
    batch.step(actions)
    held = batch.observations
    os.kill(engine, signal.SIGKILL)
    begun = time.monotonic()
    with pytest.raises(EngineError, match=f"process {engine}.*killed by signal 9"):
        for _ in range(3):
            batch.step(actions)
    assert time.monotonic() - begun < DEADLINE_SECS
    with pytest.raises(EngineError):
        batch.reset()
    assert np.isfinite(held).all(), "what was held stays readable"
    batch.close()


def open_files(process):
    links = (
        os.path.join(f"/proc/{process}/fd", name) for name in os.listdir(f"/proc/{process}/fd")
    )
    names = []
    for link in links:
        with contextlib.suppress(FileNotFoundError):
            names.append(os.readlink(link))
    return [name for name in names if "causeway-rollout" in name]


def until(condition):
    deadline = time.monotonic() + DEADLINE_SECS
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_the_worlds_of_a_killed_client_are_freed(listening):
    process, path = listening
    program = textwrap.dedent(
        f"""
        import numpy as np
        from causeway.rollout import Batch
        batch = Batch(worlds=32, town="Town02", address={str(path)!r})
        print("open", flush=True)
        while True:
            batch.step(np.zeros((32, 2), np.float32))
        """
    )
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE / "src")}
    client = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, env=environment
    )
    try:
        assert client.stdout.readline() == "open\n"
        assert len(open_files(process.pid)) == 1
        client.kill()
        until(lambda: not open_files(process.pid))
    finally:
        client.kill()
        client.wait()
    with Batch(worlds=2, town="Town02", address=path) as another:
        another.step(np.zeros((2, 2), np.float32))


def test_an_engine_ends_with_its_batch_and_leaves_nothing(batch):
    opened = batch(worlds=2)
    engine = opened._engine._process
    opened.close()
    assert engine.returncode == 0
    with pytest.raises(EngineError):
        opened.reset()


def test_what_is_in_the_way_of_an_engine_stays_and_missing_folders_are_named(tmp_path):
    results = tmp_path / "results.npz"
    results.write_bytes(b"hours of work")
    missing = tmp_path / "no-maps"
    for flags, said in (
        (["--listen", results], "a file that is no socket is there"),
        (["--listen", tmp_path / "socket", "--maps", missing], str(missing)),
    ):
        ran = subprocess.run(
            [binary(), "rollout", *flags], capture_output=True, text=True, timeout=DEADLINE_SECS
        )
        assert ran.returncode != 0 and said in ran.stderr, ran.stderr
    assert results.read_bytes() == b"hours of work"


def test_what_of_a_request_cannot_be_read_is_named(batch):
    with pytest.raises((ValueError, EngineError), match="worlds"):
        batch(worlds=-1)
    with pytest.raises((ValueError, EngineError), match=r"spec\.cars"):
        batch(worlds=1, cars=-1)


def test_a_listening_engine_ends_when_asked_and_removes_its_socket(listening):
    process, path = listening
    with Batch(worlds=1, town="Town02", address=path):
        process.terminate()
        process.wait(DEADLINE_SECS)
    assert process.returncode == 0 and not path.exists()


TASK = """
about = "Straight on among a few cars."
ends = ["arrived", "collision"]
[way]
length_m = [50, 120]
bends_degrees_max = 10
[time]
mean_kmh = 20
more_secs = 5
[start]
speed_mps = [2, 3]
beside_m = 0
turned_rad = 0
[others]
cars = 5
lights = true
[reward]
step = -1
"""


def test_a_task_of_ones_own_is_a_file(batch, tmp_path):
    (tmp_path / "mine.toml").write_text(TASK)
    mine = batch("mine", tasks=tmp_path, worlds=4, tier="kinematic", normalise=False)
    assert all(50.0 <= way <= 120.0 for way in mine.ways_m)
    assert ((mine.observations[:, 0] >= 2.0) & (mine.observations[:, 0] <= 3.0)).all()
    _, rewards, _, _ = mine.step(np.zeros((4, 2), np.float32))
    assert (rewards == -1.0).all()
    with pytest.raises(ValueError, match="there is no such task"):
        batch("other", tasks=tmp_path)
    (tmp_path / "mine.toml").write_text(TASK.replace("cars = 5", "lorries = 5"))
    with pytest.raises(ValueError, match=r"task mine cannot be read: .*line 15") as refused:
        batch("mine", tasks=tmp_path)
    assert "lorries" in str(refused.value)


def test_blocks_are_parts_of_rows(batch):
    for observation, names in {
        "drive": ["ego", "route", "goal", "light", "partners"],
        "wide": ["ego", "route", "partners", "lights", "road"],
    }.items():
        one = batch("corl17-traffic", tier="kinematic", observation=observation, worlds=2)
        assert [block.name for block in one.blocks] == names
        assert sum(block.count * block.width for block in one.blocks) == one.width
        partners = next(block for block in one.blocks if block.name == "partners")
        part = partners.of(one.observations)
        assert part.shape == (2, partners.count, partners.width)
        assert np.shares_memory(part, one.observations)
        column = one.columns[partners.first]
        assert column.name.startswith("partners.0.")
    assert one.width == 1847
