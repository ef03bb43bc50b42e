"""Files that are watched: somebody is told when one has been saved, replaced or removed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from pathlib import Path

INTERVAL = 0.03  # seconds between two looks; a change is told of when it has been there for two

Mark = tuple[int, int, int] | None  # what changes with a file; None for one that is not there


class Watcher:
    """A thread that looks at files, those that `paths()` names at the time, and tells `changed(path)`.

    Looking at a few files thirty times a second costs next to nothing, and unlike notices from the system it also sees
    what comes over a network, and editors that put a new file in the old one's place.
    """

    def __init__(self, paths: Callable[[], Iterable[Path]], changed: Callable[[Path], object]) -> None:
        self._paths, self._changed = paths, changed
        self._known: dict[Path, Mark] = {}  # the versions that nobody has to be told of
        self._turn, self._closed = threading.Lock(), threading.Event()
        self.look()
        threading.Thread(target=self._work, name="watcher", daemon=True).start()

    def close(self) -> None:
        self._closed.set()

    def look(self) -> dict[Path, Mark]:
        """See which files there are to be watched: those that were not are known as they are now."""
        with self._turn:
            now = {path: mark_of(path) for path in self._paths()}
            self._known = {path: self._known.get(path, mark) for path, mark in now.items()}
        return now

    def _work(self) -> None:
        before: dict[Path, Mark] = {}
        while not self._closed.wait(INTERVAL):
            now = self.look()
            for path, mark in now.items():
                if mark != self._known.get(path, mark) and mark == before.get(path, mark):  # else it is being written
                    self._known[path] = mark
                    self._changed(path)
            before = now


def mark_of(path: Path) -> Mark:
    """When a file was written, its size, and which file it is."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
