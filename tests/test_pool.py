"""Work that is shared among threads."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from raytracer import backend, plain, render_scene
from raytracer.arrays import BELL, BOARD, TAKEN
from raytracer.bench import spread
from raytracer.pool import alone, share, together

KERNELS = backend.load()
ROOT = Path(__file__).parent.parent
compiled = pytest.mark.skipif(KERNELS is plain, reason="numba is not installed")
several_cores = pytest.mark.skipif(
    not hasattr(os, "sched_getaffinity") or len(os.sched_getaffinity(0)) < 2, reason="no core to spare"
)


@pytest.mark.parametrize("threads", [1, 2, 5, None])
def test_every_job_is_done_once_and_told_of_by_the_caller(threads):
    done, told = [], []

    def work(job, worker):
        done.append((job, worker, threading.get_ident()))
        return -job

    share(list(range(50)), work, threads, lambda result: told.append((result, threading.get_ident())))
    assert sorted(job for job, _, _ in done) == list(range(50))
    assert sorted(-result for result, _ in told) == list(range(50))
    assert {thread for _, thread in told} == {threading.get_ident()}
    assert all((worker == 0) == (thread == threading.get_ident()) for _, worker, thread in done)
    assert max(worker for _, worker, _ in done) < (threads or 100)


@several_cores
def test_helpers_are_kept_off_the_core_of_whoever_calls():
    """Else some pictures take twice as long, with a core idle."""
    helpers, both = {}, threading.Barrier(2, timeout=5)

    def work(job, worker):
        both.wait()
        if worker:
            helpers[threading.get_native_id()] = os.sched_getaffinity(0)

    for _ in range(5):
        share([0, 1], work, 2)
    allowed = os.sched_getaffinity(0)
    assert helpers
    for cores in helpers.values():
        assert cores < allowed
        assert len(cores) == len(allowed) - 1


@several_cores
def test_a_caller_that_keeps_to_one_core_does_not_keep_the_helpers_there():
    allowed, both = os.sched_getaffinity(0), threading.Barrier(2, timeout=5)

    def helper_cores():
        cores = []

        def work(job, worker):
            both.wait()
            if worker:
                cores.append(os.sched_getaffinity(0))

        share([0, 1], work, 2)
        return cores

    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert helper_cores() == [{min(allowed)}]
    finally:
        os.sched_setaffinity(0, allowed)
    assert len(helper_cores()[0]) == len(allowed) - 1


@compiled
def test_who_lingers_says_first_that_the_task_has_ended_and_goes_when_the_bell_rings():
    ended, board = np.zeros(1, np.int64), np.zeros(BOARD, np.int64)
    assert not KERNELS.has_ended(ended, 10)
    thread = threading.Thread(target=KERNELS.linger, args=(ended, board, 1 << 40), daemon=True)
    thread.start()
    assert KERNELS.has_ended(ended, 1 << 40)
    thread.join(0.05)
    assert thread.is_alive()
    board[BELL] += 1
    thread.join(5)
    assert not thread.is_alive()
    KERNELS.linger(ended, board, 10)  # and not for ever


@compiled
def test_helpers_that_linger_help_again():
    helped, both = [], threading.Barrier(2, timeout=5)

    def work(job, worker):
        both.wait()
        helped.append(worker)

    for _ in range(20):
        share([0, 1], work, 2)
    assert sorted(helped) == [0] * 20 + [1] * 20


if KERNELS is not plain:
    from raytracer.kernels.compiler import borrowing
    from raytracer.kernels.waiting import add, becomes, offering, wait_for_help

    @borrowing
    def _arrive(seats_taken, here, expected, seat):
        """Say that this seat is taken, and wait a while until so many threads have said so."""
        seats_taken[seat] += 1
        add(here, 0, 1)
        return becomes(here, 0, expected, 1 << 26)

    _offer_to_arrive = offering(_arrive)

    @borrowing
    def _meet(board, seats, seats_taken, here, expected):
        helped = _offer_to_arrive(board, seats, (seats_taken, here, expected))
        met = _arrive(seats_taken, here, expected, 0)
        if helped:
            wait_for_help(board)
        return met

    @borrowing
    def _dawdle(begun, done, seat):
        """The caller is done as soon as the helper has begun, who takes its time."""
        if seat == 0:
            becomes(begun, 0, 1, 1 << 26)
        else:
            begun[0] = 1
            becomes(begun, 0, 2, 1 << 20)
            done[0] = 1

    _offer_to_dawdle = offering(_dawdle)

    @borrowing
    def _end_early(board, seats, begun, done):
        helped = _offer_to_dawdle(board, seats, (begun, done))
        _dawdle(begun, done, 0)
        if helped:
            wait_for_help(board)


def own_process(program):
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, timeout=60, check=False)
    return done.returncode, done.stdout, done.stderr


def meet(call, taken, expected):
    """Whether so many threads have met in a kernel; `taken` counts who sat where."""
    return call(_meet, taken, np.zeros(1, np.int64), expected)


@several_cores
@compiled
@pytest.mark.parametrize("pause", [0, 0.05, 0.2], ids=["lingering", "asleep", "long asleep"])
def test_a_kernel_is_helped_by_who_lingers_and_by_who_is_asleep(pause):
    taken = np.zeros(2, np.int64)
    for _ in range(5):
        time.sleep(pause)
        call = together(2)
        assert meet(call, taken, 2)
        assert meet(call, taken, 2)
    assert taken.tolist() == [10, 10]


@compiled
def test_seats_that_nobody_has_claimed_are_withdrawn():
    board, taken = np.zeros(BOARD, np.int64), np.zeros(9, np.int64)
    for count in (1, 2):
        assert _meet(board, 8, taken, np.zeros(1, np.int64), 1)
        KERNELS.linger(np.zeros(1, np.int64), board, 100)
        assert taken.tolist() == [count] + [0] * 8


@several_cores
@compiled
def test_who_has_claimed_a_seat_is_waited_for():
    call = together(2)
    for _ in range(5):
        begun, done = np.zeros(1, np.int64), np.zeros(1, np.int64)
        call(_end_early, begun, done)
        assert (begun[0], done[0]) == (1, 1)


@compiled
def test_who_cannot_be_helped_is_alone():
    assert together(1) is alone
    call, taken = together(2), np.zeros(1, np.int64)
    board = call.func.__self__.board
    board[TAKEN] = 1  # another caller has it
    try:
        assert meet(call, taken, 1)
    finally:
        board[TAKEN] = 0
    assert taken.tolist() == [1]


class InterruptError(Exception):
    """From a signal."""


@several_cores
@compiled
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer")
@pytest.mark.skipif(threading.current_thread() is not threading.main_thread(), reason="signals go to another thread")
def test_nobody_is_at_work_any_more_once_an_interrupt_is_raised():
    def interrupt(number, frame):
        raise InterruptError

    def draw_until(seconds):
        signal.setitimer(signal.ITIMER_REAL, seconds)
        while True:
            render_scene(scene, "diffuse", 640, 360, out=out)

    scene, out, rng = spread(300, seed=1), np.zeros((360, 640, 3), np.uint8), np.random.default_rng(1)
    expected, before = render_scene(scene, "diffuse", 640, 360), signal.signal(signal.SIGALRM, interrupt)
    try:
        for _ in range(50):
            with pytest.raises(InterruptError):
                draw_until(rng.uniform(0.001, 0.004))
            out[:] = 7
            time.sleep(0.001)
            assert (out == 7).all()
    finally:
        signal.signal(signal.SIGALRM, before)
    np.testing.assert_array_equal(render_scene(scene, "diffuse", 640, 360), expected)
    taken = np.zeros(2, np.int64)
    assert meet(together(2), taken, 2)
    assert taken.tolist() == [1, 1]


def test_threads_are_made_once():
    """In a process of its own, where six ask at the same time."""
    program = (
        "import threading\nfrom raytracer import pool\n"
        "ask = lambda: pool.share([0, 1], lambda job, worker: job, 2)\n"
        "threads = [threading.Thread(target=ask) for _ in range(6)]\n"
        "[thread.start() for thread in threads]\n[thread.join() for thread in threads]\n"
        "names = [thread.name for thread in threading.enumerate() if thread.name.startswith('raytracer')]\n"
        "print(len(names) == len(set(names)))\n"
    )
    assert own_process(program) == (0, b"True\n", b"")


@compiled
def test_nobody_lingers_while_python_ends():
    """In a process of its own, whose helpers would linger for ever."""
    program = (
        "import threading, time\nfrom raytracer import backend, pool\n"
        "backend.load()\npool._TURNS, both = 1 << 40, threading.Barrier(2, timeout=30)\n"
        "pool.share([0, 1], lambda job, worker: both.wait(), 2)\n"
        "start = time.perf_counter()\npool._rest()\nprint(time.perf_counter() - start < 0.5)\n"
    )
    assert own_process(program) == (0, b"True\n", b"")


def test_no_jobs_are_no_trouble():
    share([], lambda job, worker: job)


@pytest.mark.parametrize("bad", [0, 7, 49])
def test_the_first_exception_ends_it_and_is_raised(bad):
    done = []

    def work(job, worker):
        if job == bad:
            raise ZeroDivisionError(str(bad))
        done.append(job)

    with pytest.raises(ZeroDivisionError, match=str(bad)):
        share(list(range(50)), work, 2)
    assert len(done) < 50


def test_an_exception_of_another_thread_is_raised_here():
    started = threading.Event()

    def work(job, worker):
        if worker == 0:
            started.wait(5)
        else:
            started.set()
            raise KeyError("elsewhere")

    with pytest.raises(KeyError, match="elsewhere"):
        share([0, 1], work, 2)


def test_many_callers_at_a_time():
    sums = []

    def call():
        results = []
        share(list(range(20)), lambda job, worker: job, 2, results.append)
        sums.append(sum(results))

    callers = [threading.Thread(target=call) for _ in range(8)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(20)
    assert sums == [190] * 8
