"""Where the command `causeway` is looked for."""

import pytest

from causeway.program import find


@pytest.fixture
def nowhere(monkeypatch, tmp_path):
    """A user who has nothing anywhere."""
    for name in ("CAUSEWAY_BIN", "CAUSEWAY_TARGET_DIR", "CAUSEWAY_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    return tmp_path


def program(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(0o755)
    return str(path)


def test_each_place_wins_over_those_before(nowhere, monkeypatch):
    built = program(nowhere / ".cache/causeway/target/release/causeway")
    assert find() == built
    monkeypatch.setenv("XDG_CACHE_HOME", str(nowhere / "xdg"))
    with pytest.raises(FileNotFoundError):
        find()
    xdg = program(nowhere / "xdg/causeway/target/release/causeway")
    assert find() == xdg
    monkeypatch.setenv("CAUSEWAY_CACHE_DIR", str(nowhere / "cache"))
    cached = program(nowhere / "cache/target/release/causeway")
    assert find() == cached
    monkeypatch.setenv("CAUSEWAY_TARGET_DIR", str(nowhere / "target"))
    target = program(nowhere / "target/release/causeway")
    assert find() == target
    on_path = program(nowhere / "bin/causeway")
    assert find() == on_path
    own = program(nowhere / "own/causeway")
    monkeypatch.setenv("CAUSEWAY_BIN", own)
    assert find() == own


def test_who_finds_nothing_is_told_what_to_do(nowhere, monkeypatch):
    with pytest.raises(FileNotFoundError, match=r"release/causeway: build it with \./run"):
        find()
    with pytest.raises(FileNotFoundError, match="'other': wanted a path"):
        find("other")
    monkeypatch.setenv("CAUSEWAY_BIN", str(nowhere / "gone"))
    with pytest.raises(FileNotFoundError, match="gone', which CAUSEWAY_BIN names"):
        find()


def test_a_program_that_is_named_is_the_one(nowhere, monkeypatch):
    monkeypatch.setenv("CAUSEWAY_BIN", program(nowhere / "own/causeway"))
    other = program(nowhere / "bin/other")
    assert find("other") == find(other) == other
