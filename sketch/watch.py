"""Files that are watched: somebody is told when one has been saved, replaced or removed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from pathlib import Path

INTERVAL = 0.05  # seconds between two looks; a change is told of when it has been there for two

Mark = tuple[int, int, int] | None  # what changes with a file; None for one that is not there


class Watcher:
    """A thread that looks at files, those that `paths()` names at the time, and tells `changed(path)`.

    Looking at two files twenty times a second costs next to nothing, and unlike notices from the system it also sees
    what comes over a network, and editors that put a new file in the old one's place.
    """

    def __init__(self, paths: Callable[[], Iterable[Path]], changed: Callable[[Path], object]) -> None:
        self._paths, self._changed = paths, changed
        self._closed = threading.Event()
        threading.Thread(target=self._work, name="watcher", daemon=True).start()

    def close(self) -> None:
        self._closed.set()

    def _work(self) -> None:
        known: dict[Path, Mark] = {}
        before: dict[Path, Mark] = {}
        while not self._closed.wait(INTERVAL):
            now = {path: mark_of(path) for path in self._paths()}
            known = {path: known.get(path, mark) for path, mark in now.items()}
            for path, mark in now.items():
                if mark != known[path] and mark == before.get(path, mark):  # else it is still being written
                    known[path] = mark
                    self._changed(path)
            before = now


def mark_of(path: Path) -> Mark:
    """When a file was written, its size, and which file it is."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
