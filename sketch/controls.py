"""What each key does: the table KEYS, the View that a key changes, and `press`. Nothing here knows of a window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from raytracer import METHODS, STAGES
from raytracer.methods import CERTIFIED

SCENE_KEYS = "1234567890-"


@dataclass(frozen=True)
class View:
    """What the user wants to see. A key press makes a new one of it."""

    scenes: tuple[Path, ...]  # of the folder, in the order in which keys count them
    place: int = 0  # which of them
    stage: str = "diffuse"
    method: str = CERTIFIED
    readings: int = 0  # how often the user has asked for the files to be read again
    pixel: tuple[int, int] | None = None  # column and row whose story is told
    help: bool = False
    legend: bool = True  # of a stage that has one
    note: str = ""  # the answer to the last key
    wish: str = ""  # what the last key wants done beside showing something: "save", "quit" or nothing

    @property
    def scene(self) -> Path:
        return self.scenes[self.place]


class Key(NamedTuple):
    """One row of KEYS. `keys` are the characters that do the same kind of thing, `label` is how people read them."""

    keys: str
    label: str
    does: str
    act: Callable[[View, str], View]


def to_scene(view: View, key: str) -> View:
    place = SCENE_KEYS.index(key)
    if place < len(view.scenes):
        return replace(view, place=place)
    return replace(view, note=f"there is no scene {place + 1}: the folder holds {len(view.scenes)}")


def to_next_scene(view: View, key: str) -> View:
    """The scene after this one, or before it; beyond the last comes the first."""
    step = 1 if key == "]" else -1
    return replace(view, place=(view.place + step) % len(view.scenes))


def to_stage(view: View, key: str) -> View:
    return replace(view, stage=next(name for name, stage in STAGES.items() if stage.key == key))


def to_next_stage(view: View, key: str) -> View:
    names = list(STAGES)
    return replace(view, stage=names[(names.index(view.stage) + 1) % len(names)])


def to_next_method(view: View, key: str) -> View:
    """The method after this one, or before it; beyond the last comes the first."""
    names, step = list(METHODS), 1 if key == "m" else -1
    return replace(view, method=names[(names.index(view.method) + step) % len(names)])


def show_legend(view: View, key: str) -> View:
    if STAGES[view.stage].legend:
        return replace(view, legend=not view.legend)
    return replace(view, note=f"stage {view.stage} has no legend")


def read_again(view: View, key: str) -> View:
    return replace(view, readings=view.readings + 1)


def save(view: View, key: str) -> View:
    return replace(view, wish="save")


def show_help(view: View, key: str) -> View:
    return replace(view, help=True)


def quit_sketch(view: View, key: str) -> View:
    return replace(view, wish="quit")


KEYS = (
    Key(SCENE_KEYS, "1…9, 0, -", "the first eleven scenes of the folder", to_scene),
    Key("[]", "[ and ]", "the scene before, the scene after", to_next_scene),
    *(Key(stage.key, stage.key, f"{name}: {stage.about}", to_stage) for name, stage in STAGES.items()),
    Key("\t", "Tab", "the next stage", to_next_stage),
    Key("mM", "m", "the next method; M the one before", to_next_method),
    Key("l", "l", "hide the legend, or show it", show_legend),
    Key("r", "r", "read the scene's file again", read_again),
    Key("s", "s", "save the picture as a PNG", save),
    Key("?", "?", "show these keys, or hide them", show_help),
    Key("\x1b", "Escape", "quit", quit_sketch),
)


def press(view: View, key: str) -> View:
    """The view after a key. What the last key or click brought up over the picture goes away."""
    row = _find(key) or _find(key.lower())
    if row is None:  # Shift alone is such a key too: it is not worth a word
        note = f"key {key} does nothing; ? shows the keys" if key.isprintable() else view.note
        return replace(view, note=note, wish="")
    quiet = replace(view, pixel=None, help=False, note="", wish="")
    after = row.act(quiet, key if key in row.keys else key.lower())
    return replace(after, help=after.help and not view.help)


def click(view: View, pixel: tuple[int, int]) -> View:
    """The view after a click on a pixel, given as column and row."""
    return replace(view, pixel=pixel, help=False, note="", wish="")


def keys_as_markdown() -> str:
    """KEYS as the README shows them."""
    rows = [f"| {row.label} | {row.does} |" for row in KEYS]
    return "\n".join(["| key | what it does |", "|---|---|", *rows])


def _find(key: str) -> Key | None:
    return next((row for row in KEYS if key in row.keys), None) if len(key) == 1 else None
