"""Episodes as data: recorded, replayed to the bit, and loaded by each format's own library."""

import io
import itertools
import json
import os
import re
import signal
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from causeway.dataset import export_lerobot, export_parquet, play, read, write
from causeway.frames import decode
from causeway.pictures import Camera, Renderer, RendererError
from causeway.policy import Follow, Random
from causeway.rollout import Batch
from mcap.reader import make_reader
from PIL import Image

from running_site import PACKAGE, binary

TASK = "corl17-straight"


def settings(**others):
    return {"town": "Town02", "program": str(binary()), **others}


def command(module, *arguments):
    return [sys.executable, "-m", module, *map(str, arguments)]


def run(module, *arguments):
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE / "src")}
    words = command(module, *arguments)
    return subprocess.run(words, env=environment, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Six episodes of a driver who arrives and four of one who does not."""
    path = tmp_path_factory.mktemp("recording") / "episodes.mcap"
    about, good = play(
        TASK, Follow(), name="follow", seeds=range(6), settings=settings(tier="kinematic")
    )
    _, bad = play(
        TASK, Random(), name="random", seeds=range(6, 10), settings=settings(tier="kinematic")
    )
    written = list(write(path, about, (one for some in (good, bad) for one in some)))
    return path, written


def test_what_is_read_is_what_was_written(recording):
    path, written = recording
    about, episodes = read(path)
    found = list(episodes)
    assert about.policy == "follow" and about.spec["task"] == TASK and len(about.columns) == 46
    assert [one.seed for one in found] == list(range(10))
    assert [one.success for one in found[:6]] == [True] * 6
    for one, other in zip(found, written, strict=True):
        assert one.numbers == other.numbers and len(one) == one.numbers["steps"]
        for name in ("observations", "actions", "rewards", "terminated", "ticks", "hashes"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
        assert one.rewards.sum() == pytest.approx(one.numbers["return"], abs=1e-3)


def test_the_mcap_library_reads_every_step(recording):
    path, written = recording
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        steps = [
            (json.loads(message.data), message.log_time)
            for _, _, message in reader.iter_messages(topics=["/causeway/step"])
        ]
    assert len(steps) == sum(len(one) for one in written)
    times = [time for _, time in steps]
    assert times == sorted(times)
    first = steps[0][0]
    assert first["observation"] == written[0].observations[0].tolist()
    assert int(first["state_hash"], 16) == written[0].hashes[0]


def test_recorded_actions_from_their_seed_give_the_same_states(recording):
    _, written = recording
    with Batch(TASK, **settings(tier="kinematic", hash_every=1)) as batch:
        for one in (written[2], written[8]):
            observations = batch.reset([one.seed]).copy()
            for frame in range(len(one)):
                assert np.array_equal(observations[0], one.observations[frame])
                observations, rewards, _, _ = batch.step(one.actions[frame : frame + 1])
                assert batch.hashes[0] == one.hashes[frame]
                assert rewards[0] == one.rewards[frame]
                observations = observations.copy()


def test_parquet_has_a_row_for_each_step(recording, tmp_path):
    path, written = recording
    assert export_parquet(tmp_path, *read(path)) == 10
    steps, ends = (pq.read_table(tmp_path / f"{name}.parquet") for name in ("steps", "episodes"))
    assert steps.num_rows == sum(len(one) for one in written) and ends.num_rows == 10
    second = steps.filter(np.asarray(steps["episode"]) == 1)
    observed = np.stack(second["observation"].to_numpy(zero_copy_only=False))
    assert np.array_equal(observed, written[1].observations)
    note = json.loads(steps.schema.metadata[b"causeway"])
    assert note["columns"][0]["name"] == "ego.speed"
    assert ends["success"].to_pylist()[:6] == [1.0] * 6


def test_the_folder_is_laid_out_as_lerobot_reads_it(recording, tmp_path):
    """Against the documented layout: the library itself needs torch."""
    import pandas

    path, written = recording
    folder = tmp_path / "set"
    assert export_lerobot(folder, *read(path)) == 10
    info = json.loads((folder / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["fps"] == 10
    assert info["total_frames"] == sum(len(one) for one in written)
    episodes = pq.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [one["length"] for one in episodes] == [len(one) for one in written]
    for row in episodes:
        place = {name: row[f"data/{name}"] for name in ("chunk_index", "file_index")}
        data = pq.read_table(folder / info["data_path"].format(**place))
        assert set(data.column_names) == set(info["features"])
        own = data.slice(row["dataset_from_index"], row["length"])
        assert own["index"].to_pylist() == list(
            range(row["dataset_from_index"], row["dataset_to_index"])
        )
        assert set(own["episode_index"].to_pylist()) == {row["episode_index"]}
        assert own["next.done"].to_pylist()[-1] and not any(own["next.done"].to_pylist()[:-1])
        observed = np.stack(own["observation.state"].to_numpy(zero_copy_only=False))
        assert np.array_equal(observed, written[row["episode_index"]].observations)
        assert row["stats/action/max"] == np.max(own["action"].to_pylist(), axis=0).tolist()
    stats = json.loads((folder / "meta/stats.json").read_text())
    together = np.concatenate([one.observations for one in written]).astype(np.float64)
    assert stats["observation.state"]["mean"] == pytest.approx(together.mean(axis=0), abs=1e-6)
    assert stats["observation.state"]["std"] == pytest.approx(together.std(axis=0), abs=1e-5)
    tasks = pandas.read_parquet(folder / "meta/tasks.parquet")
    assert tasks.loc[TASK, "task_index"] == 0
    with pytest.raises(FileExistsError):
        export_lerobot(folder, *read(path))


def test_the_commands_record_and_export(tmp_path):
    path = tmp_path / "few.mcap"
    own = ("--program", binary(), "--tier", "kinematic")
    done = run("causeway.record_episodes", TASK, "--episodes", 3, "--out", path, *own)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("arrived") == 3 and "seed 2:" in done.stdout
    again = tmp_path / "again.mcap"
    run("causeway.record_episodes", TASK, "--episodes", 3, "--out", again, *own)
    assert again.read_bytes() == path.read_bytes()
    done = run("causeway.dataset", path, "--parquet", tmp_path / "p", "--lerobot", tmp_path / "l")
    assert done.returncode == 0 and done.stdout.count("3 episodes") == 2, done.stderr
    for module, words in (
        ("causeway.record_episodes", (TASK, "--out", path, *own)),
        ("causeway.dataset", (path, "--parquet", tmp_path / "p")),
    ):
        before = path.read_bytes()
        refused = run(module, *words)
        assert refused.returncode == 2
        assert "is there already" in refused.stderr or "holds tables" in refused.stderr
        assert path.read_bytes() == before
    refused = run("causeway.record_episodes", "fly", "--out", tmp_path / "other.mcap", *own)
    assert refused.returncode == 2 and "there is no such task" in refused.stderr
    refused = run("causeway.record_episodes", TASK, "--tier", "fast", "--out", path, *own)
    assert refused.returncode == 2 and "--tier: invalid choice: 'fast'" in refused.stderr
    (tmp_path / "none.mcap").write_bytes(b"nothing")
    refused = run("causeway.dataset", tmp_path / "none.mcap", "--parquet", tmp_path / "q")
    assert refused.returncode == 2 and "no recording" in refused.stderr


def test_ctrl_c_and_a_killed_process_leave_whole_episodes(recording, tmp_path):
    path = tmp_path / "many.mcap"
    words = command("causeway.record_episodes", TASK, "--episodes", 2000, "--out", path)
    words += ["--program", str(binary()), "--tier", "kinematic"]
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE / "src"), "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        for _ in range(5):
            process.stdout.readline()
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=60)
    assert process.returncode == 130, told
    whole = list(read(path)[1])
    counted = int(re.search(r"has (\d+) whole episodes", told)[1])
    # Ctrl-C may come after the last byte of an episode and before it is counted.
    assert counted >= 4 and len(whole) - counted in (0, 1), told
    # As a kill leaves it: an end in the middle of whatever is being written.
    source, written = recording
    data = source.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: int(len(data) * 0.8)])
    _, episodes = read(cut)
    found = list(episodes)
    assert 3 <= len(found) < len(written)
    for one, other in zip(found, written, strict=False):
        assert np.array_equal(one.hashes, other.hashes)


def test_pictures_are_recorded_and_exported(site, tmp_path):
    path = tmp_path / "seen.mcap"
    own = ("--program", binary(), "--bus", site.endpoint, "--camera", "64x36")
    done = run("causeway.record_episodes", TASK, "--episodes", 2, "--out", path, *own)
    assert done.returncode == 0, done.stderr
    about, episodes = read(path)
    found = list(episodes)
    for one in found:
        assert len(one.pictures) == len(one)
        shown = [np.asarray(Image.open(io.BytesIO(data))) for data in one.pictures[::40]]
        assert all(picture.shape == (36, 64, 3) for picture in shown)
        changes = [np.abs(a.astype(int) - b).mean() for a, b in itertools.pairwise(shown)]
        assert min(changes) > 1.0, "it drives"
    again = tmp_path / "again.mcap"
    run("causeway.record_episodes", TASK, "--episodes", 2, "--out", again, *own)
    assert again.read_bytes() == path.read_bytes()
    with path.open("rb") as file:
        schema, *_ = next(make_reader(file).iter_messages(topics=["/causeway/picture"]))
    assert schema.name == "foxglove.CompressedImage"

    assert export_parquet(tmp_path / "tables", about, iter(found)) == 2
    table = pq.read_table(tmp_path / "tables/steps.parquet")
    assert table["picture"][0].as_py() == found[0].pictures[0]
    assert export_lerobot(tmp_path / "set", about, iter(found)) == 2
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    name = "observation.images.camera"
    feature = {"dtype": "image", "shape": [36, 64, 3], "names": ["height", "width", "channels"]}
    assert info["features"][name] == feature
    row = pq.read_table(tmp_path / "set/data/chunk-000/file-000.parquet")[name][0].as_py()
    assert row == {"bytes": found[0].pictures[0], "path": None}
    stats = json.loads((tmp_path / "set/meta/stats.json").read_text())[name]
    assert np.shape(stats["mean"]) == (3, 1, 1) and 0.05 < np.min(stats["mean"]) < 0.95


def test_what_cannot_be_drawn_says_why(site, tmp_path):
    for words, told in (
        (("--tier", "kinematic", "--bus", site.endpoint, "--camera", "64x36"), "kinematic"),
        (("--bus", "tcp/127.0.0.1:1", "--camera", "64x36"), "no bus"),
        (("--camera", "64"), "WIDTHxHEIGHT"),
    ):
        out = ("--program", binary(), "--out", tmp_path / f"{told}.mcap")
        refused = run("causeway.record_episodes", TASK, "--episodes", 1, *out, *words)
        assert refused.returncode == 2 and told in refused.stderr, refused.stderr
        assert not list(tmp_path.iterdir())


def test_pictures_of_branches_come_together_and_are_alike_until_they_differ(site):
    camera = Camera(width=96, height=54)
    own = settings(worlds=6, decision_ticks=10, hash_every=1)
    with Batch("lane-keep", **own) as batch, Renderer(site.endpoint) as renderer:
        batch.reset(3)
        batch.fork(0, into=range(1, 6))
        alike = renderer.draw(batch.frames(range(6)), camera)
        assert len(alike) == 6 and len(set(alike)) == 1
        # Gently: who leaves the road begins anew, and all beginnings are alike.
        for _ in range(4):
            actions = np.array([[0.02 * row - 0.05, 0.5] for row in range(6)], np.float32)
            _, _, terminated, truncated = batch.step(actions)
            assert not (terminated.any() or truncated.any())
        assert len(set(renderer.draw(batch.frames(range(6)), camera))) == 6
        (frame,) = batch.frames([2])
        decoded = decode(frame.data)
        assert decoded.map_name == "Town02" and frame.cars == [1]
        assert decoded.state_hash == batch.hashes[2]
        with pytest.raises(ValueError, match="no such world"):
            batch.frames([6])


def test_pixels_are_those_of_the_pictures_and_what_cannot_be_drawn_says_why(site):
    camera = Camera(width=96, height=54, quality=100)
    with Batch("lane-keep", **settings(worlds=70)) as batch, Renderer(site.endpoint) as renderer:
        batch.reset(3)
        frames = batch.frames(range(70))
        # More than renderers let wait.
        pictures, pixels = renderer.draw(frames, camera), renderer.pixels(frames, camera)
        assert len(pictures) == 70 and pixels.shape == (70, 54, 96, 3)
        for picture, raw in zip(pictures[::23], pixels[::23], strict=True):
            shown = np.asarray(Image.open(io.BytesIO(picture)), np.float32)
            assert np.abs(shown - raw).mean() < 4.0
        assert len(set(pictures)) > 20, "each of its own world"
        low = renderer.pixels(frames[:1], Camera(width=96, height=54, tier="low"))
        assert 0.0 < np.abs(low[0].astype(float) - pixels[0]).mean() < 20.0
        for wrong, said in (
            (Camera(width=4_096, height=4_096), r"too many pixels.*16773120.*16777216"),
            (Camera(width=5_000, height=4), r"picture size.*1 to 4096.*5000 × 4"),
            (Camera(tier="best"), "low, high or None"),
        ):
            with pytest.raises(RendererError, match=said):
                renderer.draw(frames[:2], wrong)


def test_more_frames_are_told_than_fit_one_reply():
    with Batch("lane-keep", **settings(worlds=2)) as batch:
        batch.reset(3)
        told = batch.frames([0, 1] * 513)
        assert len(told) == 1026 and told[:2] != told[1:3]
        assert all(told[row] == told[row % 2] for row in range(1026))
