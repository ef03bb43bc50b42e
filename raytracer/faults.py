"""What is wrong with a file of the user's, and where."""

from __future__ import annotations

import stat
from itertools import islice
from pathlib import Path

_LONGEST = 72  # characters of a line that are quoted
_MOST = 1 << 16  # that are read of one


class FileError(ValueError):
    """A mistake in a user's file. `str(fault)` is the one line `path:line:column: message`.

    Lines and columns count from 1, columns in characters. Where no place is known, `line` and `column` are None and the
    text is `path: message`.
    """

    def __init__(self, path: Path, line: int | None, column: int | None, message: str) -> None:
        super().__init__(path, line, column, message)
        self.path = path
        self.line = line
        self.column = column
        self.message = message

    def __str__(self) -> str:
        return f"{escaped(str(self.path))}{self.place}: {self.message}"

    @property
    def place(self) -> str:
        """:line:column, as far as they are known."""
        return "".join(f":{number}" for number in (self.line, self.column) if number is not None)

    def quote(self) -> tuple[str, int] | None:
        """The line that is at fault, as it stands in the file now, and after how many characters the fault begins.

        A long line is cut, with "…". None where the line is not known or not there any more.
        """
        text = None if self.line is None else line_of(self.path, self.line)
        if text is None:
            return None
        text, at = "".join(c if c.isprintable() else " " for c in text), max(0, (self.column or 1) - 1)
        start = max(0, at - _LONGEST // 2) if len(text) > _LONGEST else 0
        cut = text[start : start + _LONGEST]
        head, tail = "…" if start else "", "…" if start + _LONGEST < len(text) else ""
        return f"{head}{cut}{tail}", min(at - start, len(cut)) + len(head)

    def report(self) -> str:
        """The line that `str` gives, and under it the file's own, with a caret below the fault."""
        quote = self.quote()
        return str(self) if quote is None else f"{self}\n  {quote[0]}\n  {' ' * quote[1]}^"


def line_of(path: Path, number: int) -> str | None:
    """A line of a text file, counted from 1, without its end; None where it cannot be read."""
    if number < 1:
        return None
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # a pipe or a device might never answer
            return None
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            return next((line.rstrip("\r\n")[:_MOST] for line in islice(file, number - 1, number)), None)
    except OSError:
        return None


def escaped(text: str) -> str:
    """The text in one line, with escapes in place of characters that cannot be seen."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
