"""What keys and the mouse do: the table KEYS, the View that they change, and how. Nothing here knows of a window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from raytracer import METHODS, STAGES
from raytracer.methods import CERTIFIED
from raytracer.samples import ADAPTIVE, Samples, takes_samples
from sketch.orbit import HOME, Orbit

SCENE_KEYS = "1234567890-"
SAMPLES_OF_KEY: tuple[Samples, ...] = (1, 4, 16, ADAPTIVE)
MOUSE = (
    ("a click", "tells a pixel's story"),
    ("dragging", "turns the camera about the scene"),
    ("the wheel", "moves the camera, nearer or farther away"),
)
OWN, REFERENCE, DIFFERENCE, WIPE = "own", "reference", "difference", "wipe"
LENSES = {  # what is shown of a picture and of what it ought to be
    OWN: "your own picture",
    REFERENCE: "the reference",
    DIFFERENCE: "their difference",
    WIPE: "your own left of the mouse, the reference right of it",
}
SLACK = 3  # pixels: a hand that trembles does not drag

Place = tuple[int, int]  # column and row


@dataclass(frozen=True)
class Grip:
    """Where the mouse has taken hold of the picture."""

    at: Place
    orbit: Orbit  # as it was there
    pulls: bool = False  # whether the mouse has gone away from there, so that it is no click any more


@dataclass(frozen=True)
class View:
    """What the user wants to see. A key or the mouse makes a new one of it."""

    scenes: tuple[Path, ...]  # of the folder, in the order in which keys count them
    place: int = 0  # which of them
    stage: str = "diffuse"
    method: str = CERTIFIED
    samples: Samples = 1  # rays a pixel, where the stage takes more than one
    plug: Path | None = None  # a file of the user's own that is plugged in
    lens: str = OWN  # of LENSES
    border: int | None = None  # between the two pictures, a column, where the mouse has been
    readings: int = 0  # how often the scene's file is read again, for a key or because it was saved
    plug_readings: int = 0  # the same for the plugged file
    orbit: Orbit = HOME  # where the scene is seen from
    grip: Grip | None = None  # while a button is held down
    pixel: Place | None = None  # whose story is told
    help: bool = False
    legend: bool = True  # of a stage that has one
    note: str = ""  # the answer to the last key
    wish: str = ""  # what the last key wants done beside showing something: "save", "quit" or nothing

    @property
    def samples_of_stage(self) -> Samples:
        return self.samples if takes_samples(STAGES[self.stage]) else 1

    @property
    def scene(self) -> Path:
        return self.scenes[self.place]

    @property
    def seen_through(self) -> str:
        """The lens, where there is anything to compare."""
        return self.lens if self.has_own else OWN

    @property
    def has_own(self) -> bool:
        """Whether the picture is another one than the reference, or may be."""
        return self.plug is not None or self.method != CERTIFIED


class Key(NamedTuple):
    """One row of KEYS. `keys` are the characters that do the same kind of thing, `label` is how people read them."""

    keys: str
    label: str
    does: str
    act: Callable[[View, str], View]


def to_scene(view: View, key: str) -> View:
    place = SCENE_KEYS.index(key)
    if place < len(view.scenes):
        return _at_home(replace(view, place=place))
    return replace(view, note=f"there is no scene {place + 1}: the folder holds {len(view.scenes)}")


def to_next_scene(view: View, key: str) -> View:
    """The scene after this one, or before it; beyond the last comes the first."""
    step = 1 if key == "]" else -1
    return _at_home(replace(view, place=(view.place + step) % len(view.scenes)))


def to_stage(view: View, key: str) -> View:
    return replace(view, stage=next(name for name, stage in STAGES.items() if stage.key == key))


def to_next_stage(view: View, key: str) -> View:
    names = list(STAGES)
    return replace(view, stage=names[(names.index(view.stage) + 1) % len(names)])


def to_next_method(view: View, key: str) -> View:
    """The method after this one, or before it; beyond the last comes the first."""
    names, step = list(METHODS), 1 if key == "m" else -1
    return replace(view, method=names[(names.index(view.method) + step) % len(names)])


def to_next_samples(view: View, key: str) -> View:
    """More samples a pixel, and after the most one again."""
    after = SAMPLES_OF_KEY[(SAMPLES_OF_KEY.index(view.samples) + 1) % len(SAMPLES_OF_KEY)]
    note = "" if takes_samples(STAGES[view.stage]) else f"stage {view.stage} has one sample a pixel"
    return replace(view, samples=after, note=note)


def to_next_lens(view: View, key: str) -> View:
    """The user's own picture, the reference, their difference, and the two side by side."""
    if not view.has_own:
        return replace(view, lens=OWN, note="this is the reference: plug in a file, or take another method with m")
    names = list(LENSES)
    return replace(view, lens=names[(names.index(view.lens) + 1) % len(names)])


def to_file_view(view: View, key: str) -> View:
    note = "this is the file's own view" if view.orbit == HOME else ""
    return _at_home(replace(view, note=note))


def show_legend(view: View, key: str) -> View:
    if STAGES[view.stage].legend or view.seen_through in (DIFFERENCE, WIPE):
        return replace(view, legend=not view.legend)
    return replace(view, note=f"stage {view.stage} has no legend")


def read_again(view: View, key: str) -> View:
    return replace(view, readings=view.readings + 1, plug_readings=view.plug_readings + 1)


def saved(view: View, path: Path) -> View:
    """The view when a file has been saved, replaced or removed by somebody: a pixel's story is one of the past.

    What is not the scene's file is the plugged one, or one that it imports.
    """
    if path == view.scene:
        return replace(_bare(view), readings=view.readings + 1)
    return replace(_bare(view), plug_readings=view.plug_readings + 1)


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
    Key("a", "a", "anti-aliasing: 1, 4 or 16 samples a pixel, or more only where neighbours differ", to_next_samples),
    Key(
        "v",
        "v",
        "your own picture, the reference, their difference, and both with a border under the mouse",
        to_next_lens,
    ),
    Key("c", "c", "the file's own view again, after the mouse has changed it", to_file_view),
    Key("l", "l", "hide the legend, or show it", show_legend),
    Key("r", "r", "read the files again; those that are saved are read again anyway", read_again),
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
    after = row.act(_bare(view), key if key in row.keys else key.lower())
    return replace(after, help=after.help and not view.help)


def grip(view: View, at: Place) -> View:
    """The view when the mouse takes hold of the picture: a click or a drag begins."""
    return replace(view, grip=Grip(at, view.orbit), wish="")


def drag(view: View, at: Place) -> View:
    """The view when the mouse has gone there: the near side of the scene comes along."""
    held = view.grip
    if held is None:
        return replace(view, wish="")
    right, down = at[0] - held.at[0], at[1] - held.at[1]
    if not held.pulls and max(abs(right), abs(down)) <= SLACK:
        return replace(view, wish="")
    orbit = replace(held.orbit.pulled(right, down), nearer=view.orbit.nearer)
    return replace(_bare(view), orbit=orbit, grip=replace(held, pulls=True))


def hover(view: View, at: Place) -> View:
    """The view when the mouse has gone there with no button held."""
    return replace(view, border=at[0], wish="")


def release(view: View) -> View:
    """The view when the mouse lets go: if it has not pulled, that was a click."""
    held = view.grip
    if held is None or held.pulls:
        return replace(view, grip=None, wish="")
    return replace(click(view, held.at), grip=None)


def wheel(view: View, notches: int) -> View:
    """The view after so many notches of the wheel, away from the user."""
    return replace(_bare(view), orbit=view.orbit.moved(notches))


def click(view: View, pixel: Place) -> View:
    """The view after a click on a pixel."""
    return replace(_bare(view), pixel=pixel)


def keys_as_markdown() -> str:
    """KEYS as the README shows them."""
    rows = [f"| {row.label} | {row.does} |" for row in KEYS]
    return "\n".join(["| key | what it does |", "|---|---|", *rows])


def _bare(view: View) -> View:
    """Without what the last key or click brought up over the picture."""
    return replace(view, pixel=None, help=False, note="", wish="")


def _at_home(view: View) -> View:
    """From the file's own view; the mouse lets go, lest it drag the scene back."""
    return replace(view, orbit=HOME, grip=None)


def _find(key: str) -> Key | None:
    return next((row for row in KEYS if key in row.keys), None) if len(key) == 1 else None
