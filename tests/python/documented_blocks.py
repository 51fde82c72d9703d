"""Blocks of the documents, and what is done to them before they are run."""

import doctest
import re

import pytest

from documents import Block, Page, pages
from running_site import Site

#: Blocks that no test runs, by a word in them, and why.
NOT_RUN = {
    "./run ": "it installs what is missing and starts a site; `./test` does the same before this",
    "./test fuzz": "it takes minutes; `./test` reads fewer damaged recordings",
    "cargo bench": "it takes minutes; that it exists is tested",
    "causeway bench": "it takes minutes; that it exists is tested",
    "pytest": "it is one of the tests",
    "vector_rates": "it takes minutes; fewer agents are tested",
    "measure_site": "it takes minutes; what its lines measure is tested with less of it",
    "learn_to_see": "it takes minutes; fewer scenes are tested",
    "benches/": "it needs other simulators, or takes minutes",
    "docker": "it wants an engine; test_deploy_blocks.py runs it",
    "kubectl": "it needs a cluster; the tree is tested by test_kubernetes.py",
    "systemctl": "it changes the machine; test_deploy_blocks.py runs it in a container",
    "cargo run": "it needs maps that are not part of this repository",
    "cargo nextest": "`./test` runs all tests of Rust",
}


def cases(*languages: str) -> list:
    found = [(page, block) for page in pages() for block in page.blocks(*languages)]
    return [
        pytest.param(page, block, id=f"{page.name}:{block.line}")
        for page, block in found
        if not any(word in block.text for word in NOT_RUN)
    ]


def printed_by(page: Page, block: Block) -> str | None:
    """The block of text right behind this one."""
    behind = [other for other in page.blocks("python", "text", "sh") if other.line > block.line]
    return behind[0].text if behind and behind[0].language == "text" else None


def matches(wanted: str, printed: str) -> bool:
    if "..." not in wanted:
        return printed == wanted
    texts = (re.sub(r"\d+(\.\d+)?", "N", text) for text in (wanted, printed))
    return doctest.OutputChecker().check_output(*texts, doctest.ELLIPSIS)


def addressed(text: str, site: Site) -> str:
    for usual, ours in (
        ("http://localhost:8000", site.base_url),
        ("https://USER-causeway.hf.space", site.base_url),
        ("tcp/127.0.0.1:7460", site.endpoint),
        ('"127.0.0.1", 2000', f'"127.0.0.1", {site.carla_port}'),
    ):
        text = text.replace(usual, ours)
    if "import carla" in text:
        # The client library sometimes ends the process when it takes itself apart.
        text += "\nimport os, sys\nsys.stdout.flush()\nos._exit(0)\n"
    return text


def page_of(name: str) -> Page:
    (page,) = [page for page in pages() if page.name == name]
    return page


def lines(block: Block) -> list[str]:
    typed = [line.split("#")[0].strip() for line in block.text.splitlines()]
    return [line for line in typed if line]


def shell_blocks() -> dict[str, list[str]]:
    """The lines of every block of commands that is run, by their first two words and page."""
    return {case.id: lines(case.values[1]) for case in cases("sh", "console")}


def take(word: str) -> list[str]:
    """The one block with this text."""
    (found,) = [block for block in shell_blocks().values() if word in "\n".join(block)]
    return found


def the_block(language: str, word: str) -> str:
    """The one with this word."""
    blocks = [block.text for page in pages() for block in page.blocks(language)]
    (found,) = [text for text in blocks if word in text]
    return found
