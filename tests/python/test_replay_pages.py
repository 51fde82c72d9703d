"""A recorded episode as one HTML file, played by a browser from the disk.

Method: an episode of a session with its steps beside its journal; what the page says of a moment is
compared with what the session said then. Wants Debian's `chromium`.
"""

import html
import json
import re
import shutil
import subprocess

import causeway
import pytest

from test_exact_recordings import told

BROWSER = shutil.which("chromium")
#: More than the episode has.
STEPS = 80
#: The browser's own time, which goes as fast as it can.
VIRTUAL_MILLIS = 3_000


def shown(page, fragment: str) -> str:
    """The document as it is after the page's script has run."""
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--window-size=1280,720"]
    flags += [f"--user-data-dir={page.parent / 'browser'}"]
    flags += [f"--virtual-time-budget={VIRTUAL_MILLIS}", "--dump-dom"]
    done = subprocess.run(
        [BROWSER, *flags, f"file://{page}{fragment}"], capture_output=True, text=True, timeout=300
    )
    return html.unescape(done.stdout)


def scores(document: str) -> dict[str, str]:
    return dict(re.findall(r"<th[^>]*>([^<]+)</th><td>([^<]+)</td>", document))


def test_an_episode_is_played_from_the_disk(start_site, tmp_path):
    if BROWSER is None:
        pytest.skip("no chromium: apt-get install chromium")
    site = start_site("--no-render")
    at = ("--connect", site.endpoint)
    seen, steps = [], tmp_path / "steps.jsonl"
    with causeway.Session(site.base_url) as session, steps.open("w") as lines:
        begun = session.reset("trolley_saves", seed=1).observation["simulation_time"]
        world = told("worlds", *at).split()[0]
        journal = told("start", "--world", world, *at).split()[0]
        for _ in range(STEPS):
            step = session.step("observe")
            now = step.observation["simulation_time"]
            seen.append((now, step.observation["speed_kmh"], step.observation["collided_with"]))
            line = {"simulation_time": now, "action": "observe", "reward": 1 / 3}
            lines.write(json.dumps(line) + "\n")
            if step.done:
                break
        told("stop", "--world", world, *at)
    path = site.log.parent / "recordings" / journal
    page = tmp_path / "episode.html"
    told("page", path, "--to", page, "--every", "1", "--steps", steps)
    first, last = seen[0], seen[-1]
    document = shown(page, f"#t={last[0] - first[0]:.3f}")
    met = int(scores(document)["collisions"])
    assert document.count('class="collision"') >= met
    assert scores(document)["steps"] == str(len(seen))
    assert "observe, reward 0.3333<" in document
    (kmh,) = re.findall(r"(\d+) km/h at", document)
    assert abs(int(kmh) - last[1]) <= 1.0
    (speed_before,) = re.findall(r"(\d+) km/h at", shown(page, "#t=0.5"))
    assert abs(int(speed_before) - near(seen, first[0] + 0.5)) <= 1.0
    assert scores(shown(page, "#t=0"))["collisions"] == "0"
    # Without a moment, or with none that is a number, it plays by itself.
    for fragment in ("", "#t=soon"):
        (clock,) = re.findall(r"<output[^>]*>([\d.]+) of", shown(page, fragment))
        assert float(clock) > 0.0
    assert begun <= first[0]


def near(seen, secs: float) -> float:
    """The speed at the step that ends nearest to a time, in km/h."""
    return min(seen, key=lambda step: abs(step[0] - secs))[1]
