"""Every block of the documents runs as printed, and prints what the page says.

Addresses are replaced by those of the test's site, as another site may have the usual ones. A block
of text behind one of Python is what it prints; where it has an ellipsis its numbers vary.
"""

import contextlib
import re
import shlex
import subprocess
import sys
import time

import causeway
import httpx
import pytest

from carla_site import connect, fresh
from documented_blocks import addressed, cases, matches, page_of, printed_by, shell_blocks, take
from documents import ROOT
from running_site import two_free_ports
from shell import Shell
from test_examples import driving

DEADLINE_SECS = 120.0


@pytest.mark.parametrize(("page", "block"), cases("python"))
def test_python_prints_what_the_page_says(page, block, site, environment, tmp_path):
    program = addressed(block.text, site)
    if "import carla" in program:
        fresh(site.carla_port)
    wanted = printed_by(page, block)
    endless = "in subscription:" in program
    with contextlib.ExitStack() as stack:
        if endless:
            stack.enter_context(driving(site.base_url))
        process = stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-u", "-c", program],
                cwd=tmp_path,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
        )
        stack.callback(process.kill)
        if endless:
            printed = "".join(process.stdout.readline() for _ in range(3))
            process.kill()
        else:
            printed, _ = process.communicate(timeout=DEADLINE_SECS)
            assert process.returncode == 0, printed
    if wanted is not None:
        assert matches(wanted, printed), f"wanted:\n{wanted}\nprinted:\n{printed}"
    else:
        assert "Traceback" not in printed, printed
    for saved in re.findall(r'open\("(\w+\.jpg)"', program):
        assert (tmp_path / saved).stat().st_size > 10_000


#: What each test below runs; together they are all blocks.
TAKEN = (
    "pip install",
    "play_trolley",
    "record worlds",
    "record collisions",
    "record page",
    "incident.py",
    "causeway router --listen tcp",
    "causeway router --listen tls",
    "--bus-pki",
    "record_episodes",
    "gateway --connect tcp/127.0.0.1",
    "2000,2010@0.10",
    "causeway world --listen",
    "my-maps/Mine.xodr",
    "map query",
    "map export Town03",
    "map build",
    "health --ready",
    "rollout --help",
    "token new",
    "causeway.evaluate",
    "evaluate.dilemmas",
    "train_driver.py --out",
    "train_driver.py --seed",
    "export PATH",
)


def test_every_block_is_run_by_some_test_or_has_a_reason():
    for name, block in shell_blocks().items():
        assert any(word in "\n".join(block) for word in TAKEN), f"{name}: {block}"


def test_the_package_is_installed_and_its_example_plays(shell, site):
    (shell.folder / "agents").symlink_to(ROOT / "agents")
    shell.environment.pop("PYTHONPATH")
    before = set((ROOT / "agents").rglob("*"))
    (install,) = take("pip install")
    shell.run(install)
    # What activates the environment is the shell's own and lasts as long.
    shell.environment["PATH"] = f"{shell.folder}/.venv/bin:{shell.environment['PATH']}"
    assert {path for path in before ^ set((ROOT / "agents").rglob("*"))} == set()
    (play,) = take("play_trolley")
    printed = shell.run(f"{play} --base-url {site.base_url}")
    assert "verdict after" in printed and "pedestrians hit: 0" in printed
    assert len(list((shell.folder / "pictures").glob("*.jpg"))) == 2


def test_a_crash_is_recorded_and_found(shell, start_site):
    site = start_site("--no-render", "--recordings", str(shell.folder / "recordings"))
    (program,) = [
        case.values[1].text for case in cases("python") if "crash.log" in case.values[1].text
    ]
    fresh(site.carla_port)
    (shell.folder / "crash.py").write_text(addressed(program, site))
    printed = shell.run(f"{sys.executable} crash.py")
    assert "vehicle.audi.tt" in printed and "Replaying from" in printed
    # The recorded car ran into the parked one; this one brakes at the recorded speed.
    (gap,) = re.findall(r"stands (\d+\.\d) m", printed)
    assert 5.0 < float(gap) < 20.0
    said = [shell.run(line) for line in take("record collisions")]
    listed, collisions, blocked, info, verify, replayed, cut, exported, seen, _ = said
    assert "crash.log  log" in listed and "crash.log.journal  journal" in listed
    assert "vehicle.audi.tt" in collisions and "vehicle.audi.tt" in blocked
    assert "  role_name = hero\n" in info
    assert "120 frames" in verify and "120 frames, 0 differences" in replayed
    assert "41 frames" in cut and "120 frames" in exported and "60 frames" in seen
    (page,) = take("record page")
    assert "60 frames" in shell.run(page)
    assert "vehicle.audi.tt" in (shell.folder / "crash.html").read_text()


def test_an_incident_has_three_pictures(shell, site):
    (shell.folder / "agents").symlink_to(ROOT / "agents")
    (line,) = take("incident.py")
    ours = line.replace("python ", f"{sys.executable} ", 1)
    shell.run(f"{ours} --port {site.carla_port}")
    assert len(list((shell.folder / "incident").glob("*.jpg"))) == 3


def test_a_journal_is_kept_and_verified(shell, start_site):
    up, listing, *others = take("record worlds")
    flags = shlex.split(up)[2:]
    site = start_site("--no-render", *(flags[0], str(shell.folder / flags[1])))
    assert "no worlds of local" in shell.run(f"{listing} --connect {site.endpoint} 2>&1")
    with causeway.Session(site.base_url) as session:
        session.reset("trolley_saves", seed=1)
        listed = shell.run(f"{listing} --connect {site.endpoint}")
        (printed_id,) = {number for line in others for number in re.findall(r"\d{6,}", line)}
        ids = re.findall(r"\d{6,}", listed)
        for line in others:
            if "record start" in line or "record stop" in line:
                shell.run(f"{line.replace(printed_id, ids[0])} --connect {site.endpoint}")
                session.step("observe")
            else:
                said = shell.run(line.replace(printed_id, ids[0]))
                assert "the same to the bit" in said, said


def test_services_of_one_bus_are_started_one_by_one(shell):
    port, http, carla = two_free_ports(), two_free_ports(), two_free_ports()
    for line in take("causeway router --listen tcp"):
        ours = re.sub(r"tcp/[\w.]+:7460", f"tcp/127.0.0.1:{port}", line)
        ours = ours.replace("0.0.0.0:8000", f"127.0.0.1:{http}")
        shell.serve(ours + (f" --port {carla}" if " gateway " in line else ""))
    play_at(f"http://127.0.0.1:{http}")


def test_services_show_certificates(shell):
    (shell.folder / "deploy").symlink_to(ROOT / "deploy")
    address = f"tls/127.0.0.1:{two_free_ports()}"
    block = "\n".join(take("causeway router --listen tls"))
    made, *services = block.replace("\\\n", " ").splitlines()
    shell.run(made.replace("10.0.3.7", "127.0.0.1"))
    for line in services:
        shell.serve(re.sub(r"tls/[\w.]+:7460", address, line))
    files = {"ca": "ca.crt", "cert": "causeway-face.crt", "key": "causeway-face.key"}
    face = " ".join(f"--bus-{name} pki/{file}" for name, file in files.items())
    deadline = time.monotonic() + DEADLINE_SECS
    while True:
        with contextlib.suppress(AssertionError):
            shell.run(f"causeway record worlds --connect {address} {face}")
            break
        assert time.monotonic() < deadline, f"no world service is seen at {address}"
        time.sleep(0.1)


def test_a_bus_of_one_machine_is_closed_to_its_other_users(shell):
    (shell.folder / "deploy").symlink_to(ROOT / "deploy")
    made, up = take("--bus-pki")
    shell.run(made)
    http, bus = two_free_ports(), two_free_ports()
    shell.serve(f"{up} --http 127.0.0.1:{http} --bus tls/127.0.0.1:{bus} --no-render --no-carla")
    play_at(f"http://127.0.0.1:{http}")


def test_episodes_become_tables(shell):
    record, export = (
        line.replace("python ", f"{sys.executable} ", 1) for line in take("record_episodes")
    )
    shell.run(record.replace("--episodes 20", "--episodes 2"))
    shell.run(export)
    assert list((shell.folder / "tables").iterdir())
    assert list((shell.folder / "set").iterdir())


def test_two_people_share_a_server(shell):
    *tokens, up = take("token new")
    alice, bob = (shell.run(line).strip() for line in tokens)
    http, bus = two_free_ports(), two_free_ports()
    ours = up.replace(":8000", f":{http}").replace("2000=", f"{two_free_ports()}=")
    shell.serve(ours.replace("2100=", f"{two_free_ports()}=") + f" --bus tcp/127.0.0.1:{bus}")
    for token in (alice, bob):
        play_at(f"http://anybody:{token}@127.0.0.1:{http}")
    with pytest.raises(PermissionError):
        causeway.Session(f"http://127.0.0.1:{http}")


def play_at(base_url: str) -> None:
    """Plays one step as soon as somebody serves there."""
    deadline = time.monotonic() + DEADLINE_SECS
    while True:
        with contextlib.suppress(httpx.HTTPError):
            if httpx.get(f"{base_url}/health", timeout=2.0).json() == {"status": "healthy"}:
                break
        assert time.monotonic() < deadline, f"nobody serves at {base_url}"
        time.sleep(0.1)
    with causeway.Session(base_url) as session:
        session.reset("trolley_saves", seed=1)
        assert session.step("observe").observation["speed_kmh"] > 0.0


def test_a_world_service_runs_alone_and_a_gateway_joins_it(shell):
    (world,) = take("causeway world --listen")
    (gateway,) = take("gateway --connect tcp/127.0.0.1")
    endpoint, ports = f"tcp/127.0.0.1:{two_free_ports()}", (two_free_ports(), two_free_ports())
    usual = "tcp/127.0.0.1:7460"
    shell.serve(world.replace(usual, endpoint))
    joined = gateway.replace(usual, endpoint).replace("2000,2010", ",".join(map(str, ports)))
    assert joined.count(endpoint) == 1 and str(ports[1]) in joined
    shell.serve(joined)
    deadline = time.monotonic() + DEADLINE_SECS
    for port in ports:
        while True:
            # A client that finds nobody does not look again.
            client = connect(port)
            client.set_timeout(5.0)
            try:
                assert client.get_world().get_map().name
                break
            except RuntimeError:
                assert time.monotonic() < deadline


def test_ports_say_which_client_they_are_for(start_site):
    (up,) = take("2000,2010@0.10")
    first, second = two_free_ports(), two_free_ports()
    flags = up.replace("2000,2010", f"{first},{second}")
    site = start_site("--no-render", *shlex.split(flags)[2:])
    assert connect(first).get_server_version() == "0.9.16"
    assert connect(second).get_server_version() == "0.10.0"
    assert site.process.poll() is None


def test_maps_are_listed_checked_shown_exported_and_built(shell, start_site):
    up, *others = take("my-maps/Mine.xodr")
    (shell.folder / "my-maps").mkdir()
    shell.run("causeway map export Town10HD -o my-maps/Mine.xodr")
    flag, folder = shlex.split(up)[2:]
    site = start_site("--no-render", flag, str(shell.folder / folder))
    with causeway.Session(site.base_url) as session:
        step = session.reset("trolley_saves", scenario_config={"map_name": "Mine"}, seed=1)
        assert step.metadata["sim"]["map"] == "Mine"
    printed = "".join(map(shell.run, [*others, *take("map export Town03"), *take("map build")]))
    assert "Mine" in printed and "survives" in printed
    made = {path.name for path in shell.folder.iterdir()}
    assert {"mine.png", "town03.svg", "Town03.xodr", "Village7.xodr"} <= made


def test_a_driver_learns_and_drives_over_the_client(shell, site):
    (shell.folder / "agents").symlink_to(ROOT / "agents")
    few = "--steps 700000 --physics-steps 0 --towns Town01 --episodes 5"
    (again,) = take("train_driver.py --seed")
    learn, drive = (
        line.replace("python ", f"{sys.executable} ", 1)
        for line in take("drive_policy.py --policy")
    )
    assert shlex.split(again)[:2] == ["python", "agents/python/examples/train_driver.py"]
    assert "in Town02, which it has not seen" in shell.run(f"{learn} {few}")
    made = {path.name for path in (shell.folder / "driver").iterdir()}
    assert made == {"policy.npz", "curve.csv", "results.json", "report.html"}
    printed = shell.run(f"{drive} --port {site.carla_port} --episodes 1")
    assert "of 1 arrived" in printed and (shell.folder / "turn.jpg").stat().st_size > 10_000


def test_a_stranger_trains_a_driver_with_what_the_readme_says(environment, tmp_path):
    """Nothing is on the PATH, as the package finds what `./run` has built."""
    (tmp_path / "agents").symlink_to(ROOT / "agents")
    (learn,) = [line for line in page_of("README.md").commands() if "train_driver" in line]
    few = "--steps 20000 --physics-steps 0 --worlds 8 --towns Town01 --episodes 2"
    printed = Shell(tmp_path, environment).run(
        f"{learn.replace('python', sys.executable, 1)} {few}"
    )
    assert "in Town02, which it has not seen" in printed
    assert (tmp_path / "driver" / "report.html").exists()


def test_the_program_is_where_the_readme_says(environment, tmp_path):
    """Its line for the shell, for a user whose cache is this test's."""
    (export,) = take("export PATH")
    (tmp_path / ".cache").symlink_to(tmp_path / "cache")
    shell = Shell(tmp_path, {**environment, "HOME": str(tmp_path)})
    assert shell.run(f"{export}; command -v causeway").startswith(str(tmp_path))


def test_drivers_are_evaluated(shell):
    (line,) = take("causeway.evaluate --policies")
    printed = shell.run(line.replace("python ", f"{sys.executable} ", 1))
    page = page_of("docs/evaluate.md")
    shown, _ = [block.text.splitlines() for block in page.blocks("text")]
    assert [" ".join(line.split()) for line in shown] == [
        " ".join(line.split()) for line in printed.splitlines()[:2]
    ]
    results = shell.folder / "results"
    assert {path.name for path in results.iterdir()} == {"results.json", "report.html"}


def test_dilemmas_are_evaluated(shell, site):
    (line,) = take("evaluate.dilemmas")
    ours = line.replace("python ", f"{sys.executable} ", 1)
    chosen = "--dilemmas classic_3v1 --policies none brake"
    printed = shell.run(f"{ours} --base-url {site.base_url} {chosen}")
    page = page_of("docs/evaluate.md")
    _, shown = [block.text.splitlines() for block in page.blocks("text")]
    told = [" ".join(line.split()) for line in printed.splitlines()]
    assert [" ".join(line.split()) for line in shown] == told
    results = shell.folder / "dilemmas"
    assert {path.name for path in results.iterdir()} == {"results.json", "report.html"}


def test_a_site_is_asked_how_it_is(shell, start_site):
    up, asked = take("health --ready")
    site = start_site(*shlex.split(up)[2:-1], "127.0.0.1:0")
    port = int(re.search(r"probes +http://[\d.]+:(\d+)", site.said())[1])
    for offset in range(3):
        asked = asked.replace(str(9464 + offset), str(port + offset))
    deadline = time.monotonic() + DEADLINE_SECS
    while True:
        with contextlib.suppress(AssertionError):
            assert shell.run(asked).count('"status":"ready"') == 3
            return
        assert time.monotonic() < deadline, "the site is not ready"


def test_a_map_is_asked_in_a_shell(shell):
    (ask,) = take("map query")
    assert shell.run(ask).startswith('{"columns":["road"')


def test_rollouts_say_how_they_are_used(shell):
    (asked,) = take("rollout --help")
    assert "--listen" in shell.run(asked)
