"""The documents of the repository, cut into what can be tested."""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A block of code: its language, text, and the line it begins in."""

    language: str
    text: str
    line: int


@dataclass(frozen=True)
class Page:
    """One Markdown file; `name` is its path from the root."""

    name: str
    text: str

    def __str__(self) -> str:
        return self.name

    @property
    def prose(self) -> str:
        """The text without blocks of code."""
        return FENCE.sub("", self.text)

    def blocks(self, *languages: str) -> list[Block]:
        return [
            Block(found[1], found[2], self.text[: found.start()].count("\n") + 1)
            for found in FENCE.finditer(self.text)
            if found[1] in languages
        ]

    def inline(self) -> list[str]:
        """What stands between backticks in the prose, blanks and line ends made one blank."""
        codes = re.findall(r"`([^`]+)`", self.prose)
        return [re.sub(r"\s+", " ", code) for code in codes]

    def links(self) -> list[str]:
        return re.findall(r"\]\(([^)\s]+)\)", self.prose)

    def anchors(self) -> set[str]:
        """Names of its headings, as GitHub makes them."""
        titles = re.findall(r"^#+ (.*)$", self.prose, flags=re.MULTILINE)
        kept = (re.sub(r"[^\w\- ]", "", title.lower()) for title in titles)
        return {title.replace(" ", "-") for title in kept}

    def commands(self) -> list[str]:
        """Everything a reader may type: lines of shell blocks, and code in the prose."""
        lines = [
            line.split("#")[0].strip()
            for block in self.blocks("sh", "console")
            for line in block.text.splitlines()
        ]
        return [line for line in [*lines, *self.inline()] if line]


def tracked() -> list[str]:
    """Paths of all files that are part of the repository, with those about to be."""
    listing = ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listing, check=True, capture_output=True, text=True).stdout.split("\n")
    return sorted({name for name in names if name and (ROOT / name).is_file()})


def pages() -> list[Page]:
    return [Page(name, (ROOT / name).read_text()) for name in tracked() if name.endswith(".md")]
