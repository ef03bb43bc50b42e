"""The window: a Processing-style sketch that shows the tracer's pictures."""

import sys

if sys.argv[:1] == ["-m"]:  # `python -m sketch`, on its way to `__main__`: until there is a window, nothing is lost
    from raytracer.interrupts import end_at_once

    end_at_once()
