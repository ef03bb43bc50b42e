"""How coarse the frames of a movement are, how many are shown, and how a coarse one is made larger."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sketch.pace import BUDGET, COARSENESS, FrameRate, Pace, enlarged


def after(pace: Pace, fixed: float, pixels: float, frames: int = 30) -> list[int]:
    """How coarse some frames are whose time is fixed but for the part that goes into pixels."""
    chosen = []
    for _ in range(frames):
        chosen.append(pace.choose())
        pace.took(chosen[-1], fixed + pixels / chosen[-1] ** 2)
    return chosen


def test_what_is_fast_enough_is_drawn_in_full():
    assert set(after(Pace(), 2, 0.9 * BUDGET - 2)) == {1}


@pytest.mark.parametrize(("milliseconds", "coarse"), [(2, 2), (10, 4), (40, 8), (1000, 8)])
def test_what_a_picture_in_full_took_decides_the_first_frame(milliseconds, coarse):
    pace = Pace()
    pace.took(1, milliseconds * BUDGET)
    assert pace.choose() == coarse
    assert set(after(pace, 0, milliseconds * BUDGET)) == {coarse}


@given(st.floats(0, 20), st.floats(0, 5000))
def test_it_settles_and_does_not_flicker(fixed, pixels):
    pace = Pace()
    chosen = after(pace, fixed, pixels)
    last = chosen[-1]
    assert set(chosen[15:]) == {last}
    assert fixed + pixels / last**2 <= BUDGET or last == COARSENESS[-1]


@pytest.mark.parametrize(("part", "coarse"), [(0.7, 1), (0.9, 2), (1.1, 2)])
def test_finer_must_promise_to_be_fast_with_some_to_spare(part, coarse):
    pace = Pace()
    pace.took(1, 2 * BUDGET)
    assert pace.choose() == 2
    assert after(pace, 0, part * BUDGET)[-1] == coarse


def test_it_gets_finer_again():
    pace = Pace()
    after(pace, 0, 1000)
    assert after(pace, 0, 5)[-1] == 1


def test_an_accident_changes_nothing():
    pace = Pace()
    after(pace, 1, 0.7 * BUDGET)
    pace.took(1, 50 * BUDGET)
    assert pace.choose() == 1


def test_it_learns_what_does_not_depend_on_the_pixels():
    """Of 10 ms in full, 8 do not: the coarse picture's 8.5 ms do not mean that a finer one takes four times as long."""
    pace = Pace()
    after(pace, 0, 100)
    assert pace.choose() > 1
    pace.took(1, 9.0)
    assert pace.choose() == 1


def rates(*times: float) -> list[float | None]:
    """What is said after each frame that is shown at a time."""
    now = iter(times)
    rate, said = FrameRate(lambda: next(now)), []
    for _ in times:
        rate.shown()
        said.append(rate.a_second)
    return said


def test_the_rate_is_what_is_shown():
    said = rates(*np.arange(0, 3, 1 / 50))
    assert said[0] is None
    assert said[1:] == pytest.approx([50] * (len(said) - 1))
    assert rates(0, 1, 2, 3)[1:] == pytest.approx([1, 1, 1])


def test_the_rate_follows_and_can_be_read():
    said = rates(*np.arange(0, 1, 1 / 50), *np.arange(1, 3, 1 / 10))
    assert said[-1] == pytest.approx(10)
    changes = sum(a != b for a, b in pairwise(said))
    assert changes < 3 / 0.25 + 1


def test_at_rest_counting_begins_anew():
    times = iter([0, 0.1, 100, 100.01])
    rate = FrameRate(lambda: next(times))
    rate.shown(), rate.shown(), rate.rest()
    assert rate.a_second is None
    rate.shown()
    assert rate.a_second is None
    rate.shown()
    assert rate.a_second == pytest.approx(100)


@pytest.mark.parametrize(("small", "size"), [(1, 1), (1, 7), (2, 5), (80, 640), (42, 330), (83, 661)])
def test_a_coarse_picture_shows_what_the_full_one_shows_there(small, size):
    """The pixel's ray goes through its upper left corner: that is where it is to be seen."""
    picture = np.arange(small * small * 3).reshape(small, small, 3)
    large = enlarged(picture, size)
    assert large.shape == (size, size, 3)
    for x in range(small):
        first = -(-x * size // small)
        assert (large[:, first] == large[:, min(first + size // small - 1, size - 1)]).all()
        assert (large[first, first] == picture[x, x]).all()


def test_a_picture_in_full_is_left_alone():
    picture = np.zeros((5, 5, 3), np.uint8)
    assert enlarged(picture, 5) is picture
