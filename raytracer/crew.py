"""Who works on the pieces of a picture or a film: threads of this process, or any `concurrent.futures.Executor`.

    crew.work(draw, jobs)    what is done, as it is done; about two jobs a worker are under way

A job has to be picklable for workers in other processes. A worker of a dask cluster that dies loses nothing: the
scheduler gives its jobs to others.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from socket import gethostname
from threading import Event, get_ident
from time import perf_counter
from typing import Any, TypeVar

from raytracer.pool import cores

Job = TypeVar("Job")
Done = TypeVar("Done")

_AHEAD = 2  # jobs under way for each worker: one to work on, one to go on with
_PATIENCE = 30  # seconds until a cluster has to answer, and until it has a worker
LOCAL = "local:"

_given_up = Event()


class CrewError(OSError):
    """Those who work are gone."""


@dataclass
class Tally:
    """How busy the workers were."""

    workers: int = 0  # the most that there were
    jobs: int = 0
    busy: float = 0.0  # seconds, of all together
    started: float = field(default_factory=perf_counter)
    names: set[str] = field(default_factory=set)  # of those who did something

    @property
    def efficiency(self) -> float:
        """Seconds at work of all seconds that the workers had."""
        return self.busy / (self.workers * (perf_counter() - self.started)) if self.workers else 1.0

    def __str__(self) -> str:
        seconds = perf_counter() - self.started
        return (
            f"{_count(self.jobs, 'piece')} in {seconds:.3g} s by {_count(self.workers, 'worker')}: "
            f"busy for {self.busy:.3g} of {self.workers} × {seconds:.3g} s, {self.efficiency:.0%}"
        )


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


@dataclass(frozen=True)
class Crew:
    """An executor, and how many jobs it does at a time."""

    executor: Executor
    workers: Callable[[], int]
    tally: Tally = field(default_factory=Tally)

    def work(self, work: Callable[[Job], Done], jobs: Iterable[Job]) -> Iterator[tuple[Job, Done]]:
        """Jobs and what became of them, as they are done. The first error ends it all, and is raised."""
        left, under_way = iter(jobs), dict[Future[Any], Job]()
        try:
            while True:
                workers = max(1, self.workers())
                self.tally.workers = max(self.tally.workers, workers)
                for job in islice(left, max(0, _AHEAD * workers - len(under_way))):
                    under_way[self.executor.submit(_timed, work, job)] = job
                if not under_way:
                    return
                for future in sorted(wait(under_way, return_when=FIRST_COMPLETED).done, key=_has_failed):
                    yield under_way.pop(future), self._result(future)
        finally:
            for future in under_way:
                future.cancel()

    def _result(self, future: Future[Any]) -> Any:
        try:
            done, seconds, name = future.result()
        except BrokenExecutor as error:
            raise CrewError(f"a worker has died, and its executor with it ({error})") from error
        except Exception as error:
            if type(error).__module__.startswith("distributed"):
                raise CrewError(f"the cluster gave up: {error}") from error
            raise
        self.tally.jobs += 1
        self.tally.busy += seconds
        self.tally.names.add(name)
        return done


def _has_failed(future: Future[Any]) -> bool:
    """Those come last, so that nothing is lost that is done."""
    return future.cancelled() or future.exception() is not None


def _timed(work: Callable[[Job], Done], job: Job) -> tuple[Done, float, str]:
    start = perf_counter()
    done = work(job)
    return done, perf_counter() - start, f"{gethostname()}:{os.getpid()}:{get_ident()}"


@contextmanager
def open_crew(cluster: str | None = None, threads: int | None = None) -> Iterator[Crew]:
    """The workers of a cluster, given by the address of its dask scheduler, or "local:N" for N processes of its own.

    Or else so many threads of this process. ValueError, or OSError where nobody answers.
    """
    if cluster is not None:
        with _cluster(cluster) as crew:
            yield crew
        return
    count = threads or cores()
    executor = ThreadPoolExecutor(count, "crew")
    try:
        yield Crew(executor, lambda: count)
    finally:
        _given_up.set()
        executor.shutdown(cancel_futures=True)
        _given_up.clear()


def given_up() -> bool:
    """Whether nobody waits any more for what the threads of this process are at work on."""
    return _given_up.is_set()


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Threads and processes that begin here leave Ctrl-C to the main thread, which learns of it when this ends."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # which would end it, the first time that a process is started
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _cluster(address: str) -> Iterator[Crew]:
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise ValueError("--cluster: distributed is not installed; pip install distributed brings it") from None
    here = None
    if address.startswith(LOCAL):
        count = address.removeprefix(LOCAL)
        if not (count.isdecimal() and int(count) >= 1):
            raise ValueError(f"--cluster: found {address!r}, expected local:N, N being 1 or more, or HOST:PORT")
        quiet = {"dashboard_address": "127.0.0.1:0", "silence_logs": "CRITICAL"}
        with _deaf_to_interrupts():
            here = LocalCluster(n_workers=int(count), threads_per_worker=1, processes=True, **quiet)
    try:
        with Client(here or address, timeout=_PATIENCE, set_as_default=False) as client:
            try:
                client.wait_for_workers(1, timeout=_PATIENCE)
            except TimeoutError:
                raise CrewError(f"{address}: no worker has come within {_PATIENCE} s") from None
            yield Crew(client.get_executor(pure=False), lambda: sum(client.nthreads().values()))
    finally:
        if here is not None:
            here.close()
