"""Threads that are there already: starting one takes longer than drawing a small picture.

They wait at a queue, as those of `concurrent.futures` do, but a task is only a function, without a future and its
locks: a twentieth of a millisecond less at each end of a picture.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache, partial
from itertools import count
from queue import SimpleQueue
from threading import Thread
from time import sleep
from typing import TypeVar

_LOOKS = 200  # while the others are nearly done: to be woken takes longer

Job = TypeVar("Job")
Done = TypeVar("Done")


@cache
def cores() -> int:
    """How many threads run at a time. (To ask the system takes a tenth of a millisecond.)"""
    return os.cpu_count() or 1


class _Task:
    """Work for whichever thread is idle first, unless it is called off before."""

    def __init__(self, work: Callable[[], object]) -> None:
        self._work, self._claims, self._end = work, count(), SimpleQueue[BaseException | None]()

    def claim(self) -> bool:
        """Whether it is the caller's now, to do it or to call it off: the first one's, whatever threads there are."""
        return next(self._claims) == 0

    def do(self) -> None:
        error = None
        try:
            self._work()
        except BaseException as raised:
            error = raised
        self._end.put(error)

    def wait(self) -> BaseException | None:
        """Until it has ended, also if that is interrupted; returns what was raised."""
        interrupted: BaseException | None = None
        while True:
            try:
                for _ in range(_LOOKS):
                    if not self._end.empty():
                        break
                    sleep(0)
                error = self._end.get()
                return interrupted or error
            except KeyboardInterrupt as interrupt:
                interrupted = interrupt


def _help(tasks: SimpleQueue[_Task]) -> None:
    while True:
        task = tasks.get()
        if task.claim():
            task.do()
        del task  # and all that it holds, while there is nothing to do


@cache
def _tasks() -> SimpleQueue[_Task]:
    """The queue at which the threads wait. They end with the process."""
    tasks = SimpleQueue[_Task]()
    for number in range(cores()):
        Thread(target=_help, args=(tasks,), name=f"raytracer_{number}", daemon=True).start()
    return tasks


os.register_at_fork(after_in_child=_tasks.cache_clear)  # threads do not survive a fork


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
        for task in others:
            _tasks().put(task)
        toil(0)
    finally:
        failed = True  # if it was interrupted
        errors = [task.wait() for task in others if not task.claim()]
    tell()
    for error in filter(None, errors):
        raise error
