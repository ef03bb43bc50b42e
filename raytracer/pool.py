"""Threads that are there already: starting one takes longer than drawing a small picture.

They wait at a queue, as those of `concurrent.futures` do, but a task is only a function, without a future and its
locks: a twentieth of a millisecond less at each end of a picture.

Linux often wakes a thread on the core of whoever wakes it, where both then take turns for longer than a picture takes,
beside a core that is idle. So they are kept off that core.

To wake a thread takes a tenth of a millisecond, and as much again if it wants the interpreter while another has it. So
once they have done something, threads linger for a moment, if there are the kernels to do it without the interpreter:
until a bell rings, as there is a task, or until a kernel that is called `together` asks for help, which takes nothing.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from itertools import count
from queue import SimpleQueue
from threading import Lock, Thread, get_native_id
from types import ModuleType
from typing import Any, TypeVar

import numpy as np

from raytracer.arrays import ASKED, BELL, BOARD, SEATS, aligned

_TURNS = 60_000  # a millisecond, about: more than it takes to begin with the next picture
_NAP = 1e-3  # seconds
_LONGEST = 10.0  # seconds, if `linger` is being compiled
_kernels: ModuleType | None = None

Job = TypeVar("Job")
Done = TypeVar("Done")
Call = Callable[..., Any]


@cache
def cores() -> int:
    """How many threads run at a time. (To ask the system takes a tenth of a millisecond.)"""
    if hasattr(os, "sched_getaffinity"):  # the cores that this process may run on
        return len(os.sched_getaffinity(os.getpid()))
    return os.cpu_count() or 1


def linger_by(kernels: ModuleType) -> None:
    """Let threads linger from now on."""
    global _kernels
    _kernels = kernels


class _Task:
    """Work for whichever thread is idle first, unless it is called off before."""

    def __init__(self, work: Callable[[], object]) -> None:
        self._work, self._claims, self._end = work, count(), SimpleQueue[None]()
        self._error: BaseException | None = None
        self._is_over = False
        self.ended = np.zeros(1, np.int64)

    def claim(self) -> bool:
        """Whether it is the caller's now, to do it or to call it off: the first one's, whatever threads there are."""
        return next(self._claims) == 0

    def do(self) -> np.ndarray | None:
        """Do it, unless somebody else has claimed it; returns where to say that it has ended."""
        if not self.claim():
            return None
        try:
            self._work()
        except BaseException as raised:
            self._error = raised
        self._is_over = True
        self._end.put(None)
        return self.ended

    def wait(self) -> BaseException | None:
        """Until it has ended, also if that is interrupted, by whatever; returns what was raised."""
        interrupted: BaseException | None = None
        while True:
            try:
                if _kernels is not None:
                    with suppress(Exception):  # if it cannot be compiled
                        _kernels.has_ended(self.ended, _TURNS)
                while not self._is_over:
                    self._end.get()
                return interrupted or self._error
            except BaseException as interrupt:
                interrupted = interrupt


class _Helpers:
    """The threads, and the queue at which they wait. They end with the process."""

    def __init__(self) -> None:
        self.tasks = SimpleQueue[_Task | None]()  # None only wakes somebody, to help on the board
        self.board = aligned(BOARD, np.int64)
        self.board[:] = 0
        self._asleep = set[int]()
        self._lingering = [Lock() for _ in range(max(1, cores() - 1))]  # held by those who do
        threads = [
            Thread(target=self._help, args=(number,), name=f"raytracer_{number}", daemon=True)
            for number in range(len(self._lingering))
        ]
        for thread in threads:
            thread.start()
        self._ids = [thread.native_id for thread in threads if thread.native_id is not None]
        self._allowed: set[int] | None = None  # the cores that they are kept to

    def _help(self, number: int) -> None:
        while True:
            ended = self._work(number)  # and keep nothing of it while there is nothing to do
            with self._lingering[number]:
                if ended is not None and _kernels is not None:
                    _kernels.linger(ended, self.board, _TURNS)

    def _work(self, number: int) -> np.ndarray | None:
        """Wait for something to do; returns as `_Task.do`."""
        self._asleep.add(number)
        task = None if self._is_wanted() else self.tasks.get()
        self._asleep.discard(number)
        return np.zeros(1, np.int64) if task is None else task.do()

    def _is_wanted(self) -> bool:
        """Whether there is a seat. Waits while a kernel that may offer some has to be compiled, or loaded."""
        while self.board[ASKED] and not self.board[SEATS]:
            time.sleep(_NAP)
        return bool(self.board[SEATS])

    def rest(self) -> None:
        """Let nobody linger any more: a thread that comes back while Python ends finds no interpreter."""
        self.board[BELL] += 1
        for lock in self._lingering:
            lock.acquire(timeout=_LONGEST)

    def start(self, tasks: list[_Task]) -> None:
        self.make_way()
        for task in tasks:
            self.tasks.put(task)
        self.board[BELL] += 1

    def call(self, seats: int, kernel: Call, *arguments: object) -> Any:
        """Call a kernel, with so many seats for others."""
        try:
            self.make_way()
            self.board[ASKED] = 1  # before looking who is asleep, as they look after saying so
            for _ in range(min(seats, len(self._asleep))):
                with suppress(KeyError):  # somebody has woken in the meantime
                    self._asleep.pop()
                    self.tasks.put(None)
            return kernel(self.board, seats, *arguments)
        finally:
            self.board[ASKED] = 0

    def make_way(self) -> None:
        """Keep them off the core of the thread that calls, if it may run on others and the system tells which it is."""
        core = _this_core()
        if core is None or get_native_id() in self._ids:
            return
        with suppress(OSError):
            cores = os.sched_getaffinity(0)
            allowed = cores - {core} or cores
            if allowed != self._allowed:
                for thread in self._ids:
                    os.sched_setaffinity(thread, allowed)
                self._allowed = allowed


@cache
def _ask_core() -> Callable[[], int] | None:
    """The system's function that tells on which core it is called, if it has one."""
    if not hasattr(os, "sched_setaffinity"):
        return None
    return getattr(ctypes.PyDLL(None), "sched_getcpu", None)  # which keeps the interpreter's lock meanwhile


def _this_core() -> int | None:
    ask = _ask_core()
    core = -1 if ask is None else ask()
    return core if core >= 0 else None


_made: list[_Helpers] = []  # one at most
_making = Lock()


def _helpers() -> _Helpers:
    if not _made:
        with _making:
            if not _made:
                _made.append(_Helpers())
    return _made[0]


@atexit.register
def _rest() -> None:
    global _kernels
    _kernels = None
    for helpers in _made:
        helpers.rest()


def _begin_anew() -> None:
    global _making
    _making = Lock()
    _made.clear()


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_begin_anew)  # threads do not survive a fork


_NO_BOARD = np.zeros(BOARD, np.int64)


def alone(kernel: Call, *arguments: object) -> Any:
    """Call a kernel that others might help, without any."""
    return kernel(_NO_BOARD, 0, *arguments)


def together(threads: int) -> Call:
    """How to call kernels so that this many threads are at work on each, if they do not help another one.

    Such a kernel takes the board and a number of seats, and offers those as `kernels.waiting.offering` says.
    """
    return alone if threads < 2 or _kernels is None else partial(_helpers().call, threads - 1)


def _do(jobs: list[Job], work: Callable[[Job, int], Done], finished: Callable[[Done], object] | None) -> None:
    for job in jobs:
        result = work(job, 0)
        if finished is not None:
            finished(result)


def share(
    jobs: list[Job],
    work: Callable[[Job, int], Done],
    threads: int | None = None,
    finished: Callable[[Done], object] | None = None,
) -> None:
    """Do work(job, worker) for all jobs, in about their order, on so many threads (default: one a core).

    The calling thread is one of them, and worker 0. It is also the one that calls finished(result), soon after a job.
    The first exception ends it all, once the jobs that are being done have ended, and is raised.
    """
    workers = max(1, min(threads or cores(), len(jobs)))
    if workers == 1:
        _do(jobs, work, finished)
        return
    next_job, results, failed = count(), SimpleQueue[Done](), False

    def toil(worker: int) -> None:
        nonlocal failed
        try:
            while not failed and (k := next(next_job)) < len(jobs):
                results.put(work(jobs[k], worker))
                if worker == 0:
                    tell()
        except BaseException:
            failed = True
            raise

    def tell() -> None:
        while finished is not None and not results.empty():
            finished(results.get())

    others = [_Task(partial(toil, worker)) for worker in range(1, workers)]
    try:
        _helpers().start(others)
        toil(0)
    finally:
        failed = True  # if it was interrupted
        errors = [task.wait() for task in others if not task.claim()]
    tell()
    for error in filter(None, errors):
        raise error
