"""Threads that are there already: starting one takes longer than drawing a small picture."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from itertools import count
from queue import SimpleQueue
from typing import TypeVar

Job = TypeVar("Job")
Done = TypeVar("Done")


@cache
def cores() -> int:
    """How many threads run at a time. (To ask the system takes a tenth of a millisecond.)"""
    return os.cpu_count() or 1


@cache
def _executor() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores(), "raytracer")


os.register_at_fork(after_in_child=_executor.cache_clear)  # threads do not survive a fork


def _end_threads() -> None:
    """Let the threads end when they are done; whoever wants some will start new ones."""
    _executor().shutdown(wait=False)
    _executor.cache_clear()


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

    others: list[Future[None]] = []
    try:
        others.extend(_executor().submit(toil, worker) for worker in range(1, workers))
        toil(0)
    except KeyboardInterrupt:
        failed = True
        _end_threads()  # one that was just being started would be forgotten, and waited for at the end
        raise
    finally:
        late = [future for future in others if not future.cancel()]
        errors = [future.exception() for future in late]
    tell()
    for error in filter(None, errors):
        raise error
