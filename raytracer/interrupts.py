"""How the command line ends when it is told to: soon, without a traceback, and with nothing left half written.

Loaded before anything else, so that Ctrl-C is quiet from the start on; it imports nothing that takes time.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

_ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_came: list[int] = []  # of these


class _Told(KeyboardInterrupt):
    """To end. After a plain KeyboardInterrupt that leaves an `exec`, `python -m` ends by SIGINT, whatever we say."""


def end_at_once() -> None:
    """From now on Ctrl-C ends the process without a word: there is nothing yet to clean up, or nothing more."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda number, frame: os._exit(128 + number))


@contextmanager
def noted() -> Iterator[None]:
    """While this lasts, a signal to end raises KeyboardInterrupt, and is remembered.

    In the middle of compiling that exception may be swallowed, or become another one; where Python can only write down
    an exception, as in `__del__`, this one is not written down. What is ignored, as by `nohup`, stays so.
    """

    def note(number: int, frame: FrameType | None) -> None:
        _came.append(number)
        raise _Told

    def say(unraisable: sys.UnraisableHookArgs) -> None:
        if not (_came and isinstance(unraisable.exc_value, KeyboardInterrupt)):
            saying(unraisable)

    _came.clear()
    saying, sys.unraisablehook = sys.unraisablehook, say
    before = {number: signal.getsignal(number) for number in _ENDING}
    heeded = [number for number in _ENDING if before[number] is not signal.SIG_IGN]
    try:
        for number in heeded:
            signal.signal(number, note)
        yield
    finally:
        for number in heeded:
            signal.signal(number, before[number] or signal.SIG_DFL)
        sys.unraisablehook = saying


def came() -> bool:
    """Whether the command was told to end."""
    return bool(_came)


def status() -> int:
    """The exit status that says so, as shells count: 130 for Ctrl-C; 0 if nobody has."""
    return 128 + _came[0] if _came else 0


def leave(status: int) -> NoReturn:
    """End the process with this exit status, whatever threads are at: what is being compiled would be waited for."""
    sys.stderr.flush()
    os._exit(status)
