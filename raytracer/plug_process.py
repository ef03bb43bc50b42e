"""A plugged file runs in a process of its own: one that hangs is given up, and what it prints or eats stays there.

    here ── order ──> child: loads the file, draws ── print, picture, … , done or fault ──> here

A process draws one picture, so that each begins with the file as it is saved then; the next one is started ahead and
has everything but the file loaded.
"""

from __future__ import annotations

import argparse
import ctypes
import io
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from raytracer.interpreter import interpret
from raytracer.plan import make_plan
from raytracer.plug import Order, Plug, PlugError, draw_plugged, is_own, load_plug
from raytracer.render import Cancelled, draw

PATIENCE = 60.0  # seconds without a sign of life after which a picture is given up
MEMORY = 4 << 30  # bytes that a plugged file may take, unless less are free
MOST_LINES, LONGEST_LINE = 1000, 2000  # that are printed of each picture, and characters of each
_LOOK = 0.02  # seconds between two questions whether the picture is still wanted
_LONG = 0.5  # seconds after which the next process is started though this one is at work, on the same cores
_OFTEN = 0.05  # seconds from one message about the picture to the next

Tell = Callable[..., object]  # see `draw_plugged` and `exam.examine`
Names = tuple[str, ...]
Say = Callable[[str], object]


def echo(line: str) -> None:
    """Write a line to the standard output, whatever it holds, and whether or not anybody reads."""
    if sys.stdout is None:  # a program without a terminal, on Windows
        return
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    with suppress(OSError, ValueError):
        sys.stdout.write(line.encode(encoding, "backslashreplace").decode(encoding) + "\n")
        sys.stdout.flush()


def plugged_file(text: str) -> Path:
    """The file that an argument names. Raises `argparse.ArgumentTypeError` if there is none, or it is not in Python."""
    path = Path(text)
    if not path.is_file():
        raise argparse.ArgumentTypeError(f"found {text!r}, which is no file, expected one in Python")
    if path.suffix.lower() != ".py":
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a file in Python, whose name ends in .py")
    return path


def seconds(text: str) -> float:
    """The time that an argument names. Raises `argparse.ArgumentTypeError` if it is none."""
    try:
        if (patience := float(text)) > 0:
            return patience
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"found {text!r}, expected seconds, more than 0")


@dataclass
class PlugRunner:
    """Runs a plugged file, one process a task. `say` is given what the file prints, line by line."""

    path: Path
    patience: float = PATIENCE
    say: Say = lambda line: None
    ahead: bool = False  # whether the next process is started before it is needed
    files: tuple[Path, ...] = ()  # the plugged file and the modules of one's own that it has last imported
    _spare: _Child | None = field(default=None, init=False)
    _busy: _Child | None = field(default=None, init=False)
    _closed: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        if self.ahead:
            self._spare = _Child()

    def draw(
        self, order: Order, tell: Tell = lambda picture, done: None, cancelled: Callable[[], bool] = lambda: False
    ) -> tuple[np.ndarray | None, Names, Names]:
        """The picture, uint8 (height, width, 3), which functions of the file had a part in it, and which had not.

        None if none of them had. Raises `PlugError`, and `Cancelled` when that is said.
        """
        found: tuple[np.ndarray | None, Names, Names] = self.run("draw", order, tell, cancelled)
        return found

    def examine(self, scenes: list[Path], size: int, tell: Tell) -> Names:
        """Tell the results of `exam.examine` one by one; which functions the file has. Raises `PlugError`."""
        names: Names = self.run("examine", (scenes, size), tell, lambda: False)
        return names

    def run(self, task: str, given: Any, tell: Tell, cancelled: Callable[[], bool]) -> Any:
        """Have a task of `_TASKS` done by a process of its own."""
        child, self._spare = self._spare or _Child(), None
        self._busy = child
        try:
            child.begin(task, (self.path, given))
            return self._follow(child, tell, cancelled)
        finally:
            child.kill()
            self._busy = None
            self._get_ready()

    def _get_ready(self) -> None:
        """Start the process for the next picture."""
        if self.ahead and self._spare is None and not self._closed:
            self._spare = _Child()

    def close(self) -> None:
        """End all processes."""
        self._closed = True
        for child in (self._spare, self._busy):
            if child is not None:
                child.kill()

    def _follow(self, child: _Child, tell: Tell, cancelled: Callable[[], bool]) -> Any:
        for kind, content in self._messages(child, lambda: self._closed or cancelled()):
            if kind == "done":
                return content
            if kind == "news":
                tell(*content)
            elif kind == "print":
                self.say(content)
            elif kind == "files":
                self.files = content
            elif kind == "fault":
                raise PlugError(*content)
            elif kind == "refusal":
                raise PlugError(self.path, None, None, content)
            elif not self._closed:
                raise PlugError(self.path, None, None, f"ended before it was done: {child.epitaph()}")
        raise Cancelled

    def _messages(self, child: _Child, cancelled: Callable[[], bool]) -> Iterator[tuple[str, Any]]:
        """What the child says, until that is not wanted any more. Prints are no sign of life: a loop may print."""
        begun = heard = time.monotonic()
        while not cancelled():
            with suppress(queue.Empty):
                message = child.messages.get(timeout=_LOOK)
                heard = heard if message[0] == "print" else time.monotonic()
                yield message
            if time.monotonic() - begun > _LONG:
                self._get_ready()
            if time.monotonic() - heard > self.patience:
                text = f"no sign of life for {self.patience:g} seconds: given up (does it loop for ever?)"
                raise PlugError(self.path, None, None, text)


class _Child:
    """A process that does one task, as seen from here. Its messages end with ("end", None)."""

    def __init__(self) -> None:
        here = str(Path(__file__).resolve().parent.parent)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "raytracer.plug_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [here, os.environ.get("PYTHONPATH")]))},
            start_new_session=True,  # Ctrl-C is for us; when we have ended, the child ends by itself
        )
        self.messages: queue.Queue[tuple[str, Any]] = queue.Queue(64)
        self._dead = threading.Event()
        threading.Thread(target=self._listen, name="plug listener", daemon=True).start()

    def begin(self, task: str, given: Any) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # it is dead already, and `messages` say so
            pickle.dump((task, given), self._process.stdin)
            self._process.stdin.flush()  # and stays open: when this process ends, the child sees it

    def kill(self) -> None:
        """End it, and whatever it has started."""
        self._dead.set()
        self._wait()
        with suppress(OSError):  # what was not written any more
            assert self._process.stdin is not None
            self._process.stdin.close()

    def _wait(self) -> int:
        if self._process.returncode is None and hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()
        return self._process.wait()

    def epitaph(self) -> str:
        """How it ended."""
        status = self._wait()
        return f"killed by {signal.Signals(-status).name}" if status < 0 else f"exit status {status}"

    def _listen(self) -> None:
        message: tuple[str, Any] = ("", None)
        while message[0] != "end":
            try:
                message = pickle.load(self._process.stdout)  # type: ignore[arg-type]
            except (EOFError, OSError, ValueError, pickle.UnpicklingError):
                message = ("end", None)
            while not self._dead.is_set():
                with suppress(queue.Full):
                    self.messages.put(message, timeout=1)
                    break
        assert self._process.stdout is not None
        self._process.stdout.close()  # here, since who closes it elsewhere waits for what is read here


# ---------------------------------------------------------------------------------------------- within the process


def serve() -> None:
    """Do one task and end."""
    channel, orders = os.fdopen(os.dup(1), "wb"), sys.stdin.buffer
    os.dup2(2, 1)  # what a library prints goes where errors go
    _end_with_parent()
    _warm_up()
    try:
        task, (path, given) = pickle.load(orders)
    except EOFError:  # it is not needed any more
        os._exit(0)
    threading.Thread(target=_end_with, args=(orders,), daemon=True).start()
    send, before = _Sender(channel), set(sys.modules)
    printer = _Printer(send)
    sys.stdout = sys.stderr = printer
    sys.stdin = Path(os.devnull).open()  # noqa: SIM115 (as long as the process)
    sys.dont_write_bytecode = True  # which would be stale where a file is saved twice within a second
    try:
        _limit_memory()
        answer = "done", _TASKS[task](load_plug(path), given, send)
    except PlugError as error:
        answer = "fault", (error.path, error.line, error.column, error.message)
    except (ValueError, OSError, MemoryError) as error:
        answer = "refusal", str(error) or type(error).__name__
    printer.end_line()
    send("files", (path, *own_modules(path, before)))
    send(*answer)
    os._exit(0)  # whatever threads the file has started


def _draw(plug: Plug, order: Order, send: _Sender) -> tuple[np.ndarray | None, Names, Names]:
    names = plug.parts_of(order.stage)
    others = tuple(name for name in plug.functions if name not in names)
    return draw_plugged(plug, order, send.picture) if names else None, names, others


def _examine(plug: Plug, given: tuple[list[Path], int], send: _Sender) -> Names:
    from raytracer.exam import examine

    for result in examine(plug, *given):
        send("news", (result,))
    return tuple(plug.functions)


_TASKS: dict[str, Callable[[Plug, Any, _Sender], Any]] = {"draw": _draw, "examine": _examine}


class _Sender:
    """Writes messages, from one thread at a time."""

    def __init__(self, channel: IO[bytes]) -> None:
        self._channel, self._turn, self._last = channel, threading.Lock(), 0.0

    def __call__(self, kind: str, content: Any) -> None:
        with self._turn:
            pickle.dump((kind, content), self._channel, pickle.HIGHEST_PROTOCOL)
            self._channel.flush()

    def picture(self, picture: np.ndarray, done: float) -> None:
        """Send a picture as far as it has come, unless one was sent a moment ago."""
        now = time.monotonic()
        if now - self._last > _OFTEN:
            self._last = now
            self("news", (picture, done))


class _Printer(io.TextIOBase):
    """What the file prints, line by line, and no more of it than anybody reads."""

    def __init__(self, send: _Sender) -> None:
        self._send, self._line, self._lines = send, "", 0

    def writable(self) -> bool:
        return True

    def write(self, text: str) -> int:
        *lines, self._line = (self._line + text).split("\n")
        for line in lines:
            self._lines += 1
            if self._lines <= MOST_LINES:
                self._send("print", line[:LONGEST_LINE])
            elif self._lines == MOST_LINES + 1:
                self._send("print", f"… more than {MOST_LINES} lines: the rest is left out")
        self._line = self._line[:LONGEST_LINE]
        return len(text)

    def end_line(self) -> None:
        """Show a last line without an end too."""
        if self._line:
            self.write("\n")


def _warm_up() -> None:
    """Do what takes time once, and is not known from what is asked for."""
    import psutil  # noqa: F401 (loaded ahead)

    ball = interpret("surface 1 1 1 0 0 0 0 0 0 1 0\nlight 0 0 0 1 1 1\nsphere 1 0 0 -3")
    draw(make_plan(ball, width=64, height=64))


def own_modules(path: Path, before: set[str]) -> list[Path]:
    """The files beside the plugged one that were imported since these modules were."""
    files = [getattr(sys.modules[name], "__file__", None) for name in set(sys.modules) - before]
    return [Path(file) for file in files if file and is_own(file, path.resolve().parent) and Path(file) != path]


def _end_with_parent() -> None:
    """Have Linux end this process with the one that has started it, also where one line of the file runs for ever."""
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def _end_with(orders: IO[bytes]) -> None:
    """End this process when the one that has started it does."""
    orders.read()
    os._exit(0)


def _limit_memory() -> None:
    """Let the file run out of memory before the machine does."""
    try:
        import resource  # which Windows has not
    except ImportError:
        return
    import psutil  # slow to load

    room = min(MEMORY, int(psutil.virtual_memory().available * 0.8))
    limit, (_, most) = psutil.Process().memory_info().vms + room, resource.getrlimit(resource.RLIMIT_AS)
    limit = limit if most == resource.RLIM_INFINITY else min(limit, most)
    with suppress(ValueError, OSError):  # a system may not know this limit
        resource.setrlimit(resource.RLIMIT_AS, (limit, most))


if __name__ == "__main__":
    serve()
