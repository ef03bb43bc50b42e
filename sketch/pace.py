"""How the window keeps pace with a camera that moves: how coarse its pictures must be, how many are shown a second."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import numpy as np

COARSENESS = (1, 2, 4, 8)  # columns and rows of the window that a pixel may be drawn across
BUDGET = 12.0  # milliseconds for drawing a frame: 60 in a second, less what it takes to show one
_CALM = 0.8  # of the budget: a finer picture must promise to be that fast, so that noise changes nothing
_RECENT = 5  # pictures that are remembered


class Pace:
    """Chooses how coarse the next frame is, from how long the last pictures took."""

    def __init__(self) -> None:
        self.coarse = 1
        self._took: deque[tuple[int, float]] = deque(maxlen=_RECENT)

    def took(self, coarse: int, milliseconds: float) -> None:
        """A picture that coarse took so long; or longer, if it was given up by then."""
        self._took.append((coarse, milliseconds))

    def choose(self) -> int:
        """The finest that is fast enough."""
        limits = {coarse: BUDGET if coarse >= self.coarse else _CALM * BUDGET for coarse in COARSENESS}
        self.coarse = next(
            (coarse for coarse in COARSENESS if self._expected(coarse) <= limits[coarse]), COARSENESS[-1]
        )
        return self.coarse

    def _expected(self, coarse: int) -> float:
        """Milliseconds, on straight lines between what is known: a picture of no pixels takes none.

        Beyond the finest that is known, all of its time counts as spent on pixels. Of one kind the fastest counts: a
        slow one may be an accident.
        """
        fastest = {1 / at**2: min(ms for other, ms in self._took if other == at) for at, _ in self._took}
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
