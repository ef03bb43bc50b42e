"""How the window keeps pace with a camera that moves: how coarse its pictures must be, how many are shown a second."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import numpy as np

COARSENESS = (1, 2, 4, 8)  # columns and rows of the window that a pixel may be drawn across
BUDGET = 12.0  # milliseconds for drawing a frame: 60 in a second, less what it takes to show one
_CALM = 0.8  # of the budget: a finer picture must promise to be that fast, so that noise changes nothing
_PLENTY = 0.4  # of the budget: a size that takes less leaves time to try a finer one
_RECENT = 5  # pictures of each size that are remembered
_SELDOM = 200  # pictures between two trials of a size
_STALE = 20  # pictures after which a size that was not drawn again is forgotten


class Pace:
    """Chooses how coarse the next frame is, from how long the last pictures took."""

    def __init__(self) -> None:
        self.coarse = 1
        self._path = ""
        self._took: dict[int, deque[float]] = {}
        self._count, self._last = 0, dict[int, int]()  # of all pictures; and when one of each size was the last

    def took(self, coarse: int, milliseconds: float, path: str = "") -> None:
        """A picture that coarse took so long; or longer, if it was given up by then. On another path all is new."""
        if path != self._path:
            self._path, self._took = path, {}
        self._count += 1
        self._last[coarse] = self._count
        self._took.setdefault(coarse, deque(maxlen=_RECENT)).append(milliseconds)
        for other in [other for other in self._took if self._last[other] < self._count - _STALE]:
            del self._took[other]

    def choose(self) -> int:
        """The finest that is fast enough; now and then a finer one, to see, while there is much time to spare."""
        limits = {coarse: BUDGET if coarse >= self.coarse else _CALM * BUDGET for coarse in COARSENESS}
        self.coarse = next(
            (coarse for coarse in COARSENESS if self._expected(coarse) <= limits[coarse]), COARSENESS[-1]
        )
        return self.coarse // 2 if self._may_try() else self.coarse

    def _may_try(self) -> bool:
        """Whether to draw one frame finer than what is known to be fast enough."""
        finer = self.coarse // 2
        lately = self._count - self._last.get(finer, -_SELDOM) < _SELDOM
        return finer > 0 and not lately and self._expected(self.coarse) <= _PLENTY * BUDGET

    def _expected(self, coarse: int) -> float:
        """Milliseconds, on straight lines between what is known: a picture of no pixels takes none.

        Beyond the finest that is known, all of its time counts as spent on pixels. Of one kind the fastest counts: a
        slow one may be an accident.
        """
        fastest = {1 / at**2: min(took) for at, took in self._took.items()}
        finest = max(fastest, default=1.0)
        fastest |= {0.0: 0.0, 1.0: fastest.get(finest, 0.0) / finest}
        return float(np.interp(1 / coarse**2, sorted(fastest), [fastest[part] for part in sorted(fastest)]))


class FrameRate:
    """Counts the frames that are shown."""

    _SPAN, _PATIENCE = 0.5, 0.25  # seconds: that are looked back on; in which the figure stays, so that it can be read

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self.a_second: float | None = None  # None until it is known
        self._clock = clock
        self._shown: deque[float] = deque()
        self._measured = -np.inf

    def shown(self) -> None:
        """One more frame."""
        now = self._clock()
        self._shown.append(now)
        while len(self._shown) > 2 and self._shown[0] < now - self._SPAN:
            self._shown.popleft()
        if len(self._shown) > 1 and now - self._measured >= self._PATIENCE:
            self._measured, self.a_second = now, (len(self._shown) - 1) / (now - self._shown[0])

    def rest(self) -> None:
        """The camera stands still: the next frame begins to count anew."""
        self._shown.clear()
        self._measured, self.a_second = -np.inf, None


def enlarged(picture: np.ndarray, size: int) -> np.ndarray:
    """A square picture of that side: each place shows the pixel that its corner lies in."""
    if len(picture) == size:
        return picture
    nearest = np.arange(size) * len(picture) // size
    return picture.take(nearest, axis=1).take(nearest, axis=0)
