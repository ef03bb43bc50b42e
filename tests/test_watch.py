"""Files that are watched."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sketch.watch import INTERVAL, Watcher


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[tuple[Path, list[Path]]]:
    """A file, and the times that somebody was told that it has changed."""
    file, told = tmp_path / "scene.cli", []
    file.write_text("a")
    (tmp_path / "other.cli").write_text("a")
    watcher = Watcher(lambda: [file], told.append)
    time.sleep(4 * INTERVAL)
    yield file, told
    watcher.close()


def tells(told: list[Path]) -> bool:
    end = time.monotonic() + 10
    while not told and time.monotonic() < end:
        time.sleep(INTERVAL / 5)
    return bool(told)


def replace(file: Path) -> None:
    draft = file.with_name("draft")
    draft.write_text("b")
    draft.replace(file)


def by_a_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


CHANGES: dict[str, Callable[[Path], object]] = {
    "written to": lambda file: file.write_text("b"),
    "written to again": lambda file: file.write_text("a"),
    "replaced": replace,
    "removed": Path.unlink,
    "a folder in its place": by_a_folder,
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES.keys())
def test_every_change_is_told_of_once(change, watched):
    file, told = watched
    change(file)
    assert tells(told)
    time.sleep(4 * INTERVAL)
    assert told == [file]


def test_a_file_that_comes_back_is_told_of_too(watched):
    file, told = watched
    file.unlink()
    assert tells(told)
    told.clear()
    file.write_text("a")
    assert tells(told)


def test_nothing_is_told_of_what_has_not_changed(watched):
    file, told = watched
    file.read_text()
    (file.parent / "other.cli").write_text("b")
    time.sleep(6 * INTERVAL)
    assert told == []


def test_nothing_is_told_before_the_writing_is_done(watched):
    file, told = watched
    with file.open("w") as writing:
        for k in range(20):
            writing.write(str(k))
            writing.flush()
            time.sleep(INTERVAL / 5)
    early = len(told)
    assert tells(told)
    assert early <= 2  # 0, unless this machine was too busy to write in time
