"""Is there a display that a window can open on?"""

from __future__ import annotations

import ctypes
import os
import sys

# What Java's windows load on Linux, and the Debian packages that bring it.
LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libXtst.so.6": "libxtst6",
}


def why_no_display() -> str:
    """What is missing for a window, in one line; nothing if all is there."""
    if not sys.platform.startswith("linux"):
        return ""
    display = os.environ.get("DISPLAY")
    if not display:
        return "there is no display (DISPLAY is not set)"
    if missing := [name for name in LIBRARIES if not _loads(name)]:
        packages = " ".join(LIBRARIES[name] for name in missing)
        return f"{', '.join(missing)} cannot be loaded (on Debian: apt-get install {packages})"
    return "" if _answers() else f"no display answers at DISPLAY={display}"


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _answers() -> bool:
    """The connection stays open: an X server may start anew when its last client goes, just as Java comes."""
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    return bool(x11.XOpenDisplay(None))
