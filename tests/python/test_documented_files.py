"""Blocks of the documents that are files are read by what reads such files; none is left out."""

import json
import re
import time
from pathlib import Path

import causeway
import yaml
from causeway.rollout import Batch

from documented_blocks import printed_by, the_block
from documents import ROOT, pages
from running_site import binary

DEADLINE_SECS = 120.0

#: Languages of blocks, and the tests that read all of each.
READ_BY = {
    "python": "test_python_prints_what_the_page_says",
    "sh": "test_every_block_is_run_by_some_test_or_has_a_reason",
    "console": "test_every_block_is_run_by_some_test_or_has_a_reason",
    "toml": "test_files_of_toml_are_taken_as_printed",
    "json": "test_lines_of_the_audit_have_the_words_that_are_printed",
    "yaml": "test_prometheus_reads_files_that_there_are",
}
#: Blocks of text that no program prints, by a word in them.
DRAWN = ("│ carla-gateway │", "├── world-service ─")


def test_every_language_of_a_block_is_read_by_some_test():
    tests = "".join(path.read_text() for path in Path(__file__).parent.glob("test_documented_*.py"))
    fence = re.compile(r"^ *```(\w*)", flags=re.MULTILINE)
    for page in pages():
        opened = fence.findall(page.text)[::2]
        assert len(opened) == sum(len(page.blocks(name)) for name in {*opened}), page
        for language in opened:
            is_read = f"def {READ_BY.get(language)}(" in tests
            assert is_read or language == "text", f"{page}: {language}"
        printed = [printed_by(page, block) for block in page.blocks("python", "sh", "console")]
        for block in page.blocks("text"):
            is_drawn = any(word in block.text for word in DRAWN)
            assert block.text in printed or is_drawn, f"{page}:{block.line}"


def test_files_of_toml_are_taken_as_printed(shell, start_site):
    tenants, task = the_block("toml", "[[token]]"), the_block("toml", "[way]")
    scenario = the_block("toml", "[[actors]]")
    (shell.folder / "tokens.toml").write_text(tenants)
    assert shell.run("causeway token check tokens.toml") == "1 tenants, 1 tokens\n"
    folder = shell.folder / "tasks"
    folder.mkdir()
    (folder / "mine.toml").write_text(task)
    with Batch("mine", tasks=folder, program=str(binary())) as batch:
        batch.reset(seed=1)
    (folder / "bus.toml").write_text(scenario)
    site = start_site("--no-render", "--scenarios", str(folder))
    with causeway.Session(site.base_url) as session:
        begun = session.reset("bus", seed=1)
        assert len(begun.observation["nearby_actors"]) == scenario.count("[[actors]]")
    blocks = [page.blocks("toml") for page in pages()]
    assert sum(map(len, blocks)) == 3, "another file of TOML wants a reader"


def test_lines_of_the_audit_have_the_words_that_are_printed(shell, start_site):
    shown = json.loads(the_block("json", "action"))
    site = start_site("--no-render", "--audit", str(shell.folder / "audit"))
    with causeway.Session(site.base_url) as session:
        session.reset("trolley_saves", seed=1)
    deadline = time.monotonic() + DEADLINE_SECS
    while True:
        lines = (shell.folder / "audit" / "scenario.jsonl").read_text().splitlines()
        found = [line for line in map(json.loads, lines) if line["action"] == shown["action"]]
        if found or time.monotonic() > deadline:
            break
        time.sleep(0.1)
    (opened,) = found
    assert set(opened) <= set(shown) and {"t", "service", "session"} <= set(opened)


def test_prometheus_reads_files_that_there_are():
    config = yaml.safe_load(the_block("yaml", "scrape_configs"))
    for name in config["rule_files"]:
        assert (ROOT / "deploy" / "prometheus" / name).exists()
    (job,) = config["scrape_configs"]
    ports = [int(target.split(":")[1]) for target in job["static_configs"][0]["targets"]]
    assert ports == list(range(9464, 9469))
