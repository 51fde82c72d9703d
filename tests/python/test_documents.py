"""What documents name exists: files, links, flags, words of the code, commands."""

import functools
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import tomllib

from documents import ROOT, Page, pages, tracked
from running_site import PACKAGE, binary

PAGES = pages()
BY_NAME = {page.name: page for page in PAGES}

#: Pages that may name what is no longer, or not ours.
HISTORY = re.compile(r"docs/decisions/|CHANGELOG.md|NOTICE.md")

#: Parts of the compatibility page that are about other people's programs.
FOREIGN_SECTIONS = ("## Programs", "## CARLA's agents", "## Faults of the client")

#: Words and flags of others that pages name.
FOREIGN_WORDS = {"perf", "record", "nightly", "srunner", "WS", "Generation", "Delta"} | {
    # Kubernetes and Prometheus
    *("startupProbe", "livenessProbe", "readinessProbe", "terminationGracePeriodSeconds"),
}
FOREIGN_FLAGS = {"-quality-level", "-RenderOffScreen", "--gpus", "--build-arg", "--target"}

CODE = {".rs", ".py", ".fbs", ".c", ".html", ".wgsl"}
SOURCES = CODE | {".toml", ".sh", ".txt", ".yaml", ".service"}


def of_others(page: Page) -> Page:
    """The page without the sections about other people's programs."""
    text = page.text
    for title in FOREIGN_SECTIONS:
        text = re.sub(rf"^{re.escape(title)}$.*?(?=^## |\Z)", "", text, flags=re.M | re.S)
    return Page(page.name, text)


OURS = [of_others(page) for page in PAGES if not HISTORY.match(page.name)]
ours = pytest.mark.parametrize("page", OURS, ids=str)


@functools.cache
def source_words() -> frozenset[str]:
    """Every word of the sources and of their names, but for this file's."""
    words: set[str] = set()
    for name in tracked():
        words.update(re.findall(r"[A-Za-z_]\w*", name))
        path = ROOT / name
        is_source = path.suffix in SOURCES or name in ("run", "test")
        if is_source and path != Path(__file__):
            words.update(re.findall(r"[A-Za-z_]\w*", path.read_text(errors="replace")))
    return frozenset(words)


@functools.cache
def help_of(*command: str) -> str:
    """What a program says of itself, and with it which flags it takes."""
    result = subprocess.run(
        [*command, "--help"],
        capture_output=True,
        text=True,
        timeout=300,
        env={
            **os.environ,
            "PYTHONPATH": str(PACKAGE / "src"),
            "CAUSEWAY_PYTHON": sys.executable,
        },
    )
    assert result.returncode == 0, f"{command}: {result.stderr}"
    return result.stdout


def subcommands(text: str) -> list[str]:
    listing = re.search(r"^Commands:\n(.*?)^\S", text, flags=re.MULTILINE | re.DOTALL)
    names = re.findall(r"^  (\S+)", listing[1], flags=re.MULTILINE) if listing else []
    return [name for name in names if name != "help"]


@functools.cache
def causeway_helps() -> dict[tuple[str, ...], str]:
    """The help of `causeway` and of each of its subcommands, by the words that lead to it."""
    helps, waiting = {}, [()]
    while waiting:
        words = waiting.pop()
        helps[words] = help_of(str(binary()), *words)
        waiting.extend((*words, name) for name in subcommands(helps[words]))
    return helps


def flags(words: list[str]) -> set[str]:
    """Flags among the words of a command, without their values."""
    return {word.split("=")[0] for word in words if re.match(r"--?[A-Za-z]", word)}


def takes(text: str, flag: str) -> bool:
    return re.search(rf"(^|[\s,]){re.escape(flag)}\b", text, flags=re.MULTILINE) is not None


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_links_lead_somewhere(page):
    for link in page.links():
        if re.match(r"https?://", link):
            continue
        path, _, anchor = link.partition("#")
        target = (ROOT / page.name).parent / path if path else ROOT / page.name
        assert target.exists(), f"{page}: {link}"
        if anchor:
            name = str(target.resolve().relative_to(ROOT))
            assert anchor in BY_NAME[name].anchors(), f"{page}: {link}"


@ours
def test_files_that_are_named_exist(page):
    known = ["/" + name for name in tracked()]
    tops = {name.split("/")[0] for name in tracked() if "/" in name}
    for code in page.inline():
        is_path = re.fullmatch(r"[\w.-]+(/[\w.-]+)+/?", code)
        if is_path and (Path(code).suffix in SOURCES or code.split("/")[0] in {*tops, "src"}):
            part = "/" + code.rstrip("/")
            assert any(f"{part}/" in f"{name}/" for name in known), f"{page}: {code}"


@ours
def test_words_of_the_code_are_in_the_code(page):
    for code in page.inline():
        for word in re.findall(r"(?<![\w-])[A-Za-z_]\w*", code):
            # The ends of figures' names come with what they are.
            stem = re.sub(r"_(total|info)$", "", word)
            known = source_words() | FOREIGN_WORDS
            assert word in known or stem in known, f"{page}: {word} of {code}"


@ours
def test_commands_of_causeway_take_their_flags(page):
    for command in page.commands():
        words = command.removeprefix("./run").split()
        if command.startswith("./run"):
            words = ["causeway", "up", *words]
        if words[0] != "causeway":
            continue
        path: tuple[str, ...] = ()
        for word in words[1:]:
            if (*path, word) not in causeway_helps():
                break
            path = (*path, word)
        assert path or len(words) == 1, f"{page}: {command}"
        is_group = bool(subcommands(causeway_helps()[path]))
        unknown = [word for word in words[1 + len(path) :] if is_group and word[0].islower()]
        assert not unknown or not path, f"{page}: no {unknown[0]} in {command}"
        for flag in flags(words):
            assert takes(causeway_helps()[path], flag), f"{page}: {flag} of {command}"


@ours
def test_flags_that_stand_alone_are_taken_by_some_command(page):
    modules = ("evaluate", "evaluate.dilemmas", "record_episodes", "dataset")
    programs = [("-m", f"causeway.{module}") for module in modules]
    programs.append((str(ROOT / "agents/python/examples/llm_drive.py"),))
    helps = [help_of(sys.executable, *words) for words in programs]
    everything = "\n".join([*causeway_helps().values(), *helps])
    launcher = (ROOT / "carla-gateway" / "src" / "launcher.rs").read_text()
    for code in page.inline():
        if not code.startswith("-") or page.name.startswith("agents/python"):
            continue
        for flag in flags(code.split()) - FOREIGN_FLAGS:
            known = takes(everything, flag) or flag.lstrip("-") in launcher
            assert known, f"{page}: {flag}"


@functools.cache
def packages() -> dict[str, Path]:
    """Folders of the crates, by name."""
    manifests = [ROOT / name for name in tracked() if name.endswith("Cargo.toml")]
    found = {}
    for manifest in manifests:
        package = tomllib.loads(manifest.read_text()).get("package")
        if package:
            found[package["name"]] = manifest.parent
    return found


TARGETS = {"--bench": "benches", "--example": "examples", "--test": "tests"}


@ours
def test_commands_of_cargo_have_their_target(page):
    for command in page.commands():
        found = re.search(r"\bcargo (bench|run|test)\b(.*)", command)
        if not found:
            continue
        assert set(re.findall(r"\b([A-Z_]+)=", command)) <= source_words(), f"{page}: {command}"
        own, _, program = found[2].partition(" -- ")
        options = own.split()
        folder = packages()[options[options.index("-p") + 1]]
        sources = list((folder / "benches").glob("*.rs"))
        for option, where in TARGETS.items():
            if option in options:
                sources = [folder / where / f"{options[options.index(option) + 1]}.rs"]
        for source in sources:
            assert source.exists(), f"{page}: {command}"
        for word in re.findall(r"(?<!\S)[a-z]\w*(?!\S)", program):
            said = any(word in source.read_text() for source in sources)
            assert said, f"{page}: {word} of {command}"


@ours
def test_python_programs_exist_and_take_their_flags(page):
    for command in page.commands():
        found = re.match(r"\S*python3? (\S+\.py)(.*)", command)
        if not found:
            continue
        program = ROOT / found[1]
        assert program.exists(), f"{page}: {command}"
        for flag in flags(found[2].split()):
            assert takes(help_of(sys.executable, str(program)), flag), f"{page}: {command}"


def test_every_table_of_figures_has_the_command_that_finds_them():
    sections = re.split(r"^(?=##+ )", BY_NAME["docs/benchmarks.md"].text, flags=re.MULTILINE)
    tables = [part for part in sections if re.search(r"^\|---", part, flags=re.MULTILINE)]
    assert len(tables) > 10
    for part in tables:
        assert Page("", part).blocks("sh"), f"no command finds: {part.splitlines()[0]}"


def test_figures_of_a_shared_site_name_a_test_or_a_command():
    """A word that stands in the code may still be no test."""
    (part,) = re.findall(
        r"^## Many machines and people$.*?(?=^## )",
        BY_NAME["docs/benchmarks.md"].text,
        flags=re.MULTILINE | re.DOTALL,
    )
    sources = [ROOT / name for name in tracked() if Path(name).suffix in (".rs", ".py")]
    tests = "".join(path.read_text() for path in sources if "test" in path.read_text())
    rows = [line for line in part.splitlines() if line.startswith("| ")][1:]
    assert rows
    for row in rows:
        named = re.findall(r"`([^`]+)`", row)
        is_found = any(" " in name or re.search(rf"(fn|def) {name}\(", tests) for name in named)
        assert is_found, f"which test or command finds it? {row}"
