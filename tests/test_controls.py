"""Keys and the mouse change the View, and nothing else does; no window is needed to try them all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from raytracer import METHODS, STAGES
from sketch.controls import KEYS, SCENE_KEYS, SLACK, View, click, drag, grip, keys_as_markdown, press, release, wheel
from sketch.orbit import FARTHEST, HOME, Orbit

SCENES = tuple(Path(f"{n:02}.cli") for n in range(1, 15))
VIEW = View(SCENES)
ALL_KEYS = [key for row in KEYS for key in row.keys]


def is_valid(view: View) -> bool:
    return (
        view.scene in view.scenes
        and view.stage in STAGES
        and view.method in METHODS
        and view.readings >= 0
        and view.wish in ("", "save", "quit")
        and "\n" not in view.note
    )


def test_no_key_does_two_things():
    assert len(ALL_KEYS) == len(set(ALL_KEYS))


@pytest.mark.parametrize("row", KEYS, ids=lambda row: row.label)
def test_every_row_has_an_effect_and_says_what_it_does(row):
    assert row.label
    assert row.does
    start = replace(VIEW, place=12, stage="hit" if row.keys != STAGES["hit"].key else "diffuse")
    for key in row.keys:
        after = press(start, key)
        assert is_valid(after)
        assert after != start


@pytest.mark.parametrize("place", range(len(SCENE_KEYS)))
def test_number_keys_load_scenes_in_order(place):
    assert press(VIEW, SCENE_KEYS[place]).place == place


def test_a_key_without_a_scene_says_so():
    after = press(replace(VIEW, scenes=SCENES[:4]), "7")
    assert after.place == 0
    assert after.note == "there is no scene 7: the folder holds 4"


def test_brackets_go_round_the_folder():
    assert press(VIEW, "]").place == 1
    assert press(VIEW, "[").place == len(SCENES) - 1
    assert press(replace(VIEW, place=len(SCENES) - 1), "]").place == 0


@pytest.mark.parametrize("name", STAGES)
def test_stage_keys(name):
    assert press(VIEW, STAGES[name].key).stage == name


def test_tab_goes_through_all_stages():
    view, seen = VIEW, []
    for _ in STAGES:
        view = press(view, "\t")
        seen.append(view.stage)
    assert sorted(seen) == sorted(STAGES)
    assert view.stage == VIEW.stage


def test_m_goes_through_all_methods_and_capital_m_back():
    view, seen = VIEW, []
    for _ in METHODS:
        seen.append(view.method)
        view = press(view, "m")
        assert press(view, "M").method == seen[-1]
    assert seen == list(METHODS)
    assert seen[0] == "certified"
    assert view == VIEW
    assert press(VIEW, "M").method == list(METHODS)[-1]


def test_a_stage_leaves_the_method_and_a_method_the_stage():
    after = press(press(press(VIEW, "x"), "m"), "]")
    assert (after.stage, after.method, after.place) == ("error", list(METHODS)[1], 1)
    assert press(after, "n").method == after.method


def test_l_hides_the_legend_and_shows_it_where_there_is_one():
    hidden = press(press(VIEW, "x"), "l")
    assert not hidden.legend
    assert press(hidden, "l").legend
    assert press(VIEW, "l").legend
    assert press(VIEW, "l").note == "stage diffuse has no legend"


def test_capital_letters_do_what_small_ones_do():
    assert press(VIEW, "N") == press(VIEW, "n")


def test_a_key_that_does_nothing_says_so_and_shift_says_nothing():
    assert "q" in press(VIEW, "q").note
    assert press(VIEW, "\uffff") == VIEW


def test_the_last_keys_wish_and_note_do_not_last():
    assert press(VIEW, "s").wish == "save"
    for key in ("n", "q", "\uffff"):
        assert press(press(VIEW, "s"), key).wish == ""
    assert press(press(VIEW, "q"), "n").note == ""


def test_help_is_hidden_by_its_own_key_and_by_any_other():
    shown = press(VIEW, "?")
    assert shown.help
    assert not press(shown, "?").help
    assert not press(shown, "n").help
    assert not click(shown, (1, 2)).help


def test_a_click_names_a_pixel_and_a_key_forgets_it():
    assert click(VIEW, (3, 4)).pixel == (3, 4)
    assert press(click(VIEW, (3, 4)), "n").pixel is None


def dragged(view: View, *places: tuple[int, int]) -> View:
    """After the mouse has taken hold at the first place, gone to the others and let go."""
    view = grip(view, places[0])
    for place in places[1:]:
        view = drag(view, place)
    return release(view)


def test_dragging_turns_the_camera_by_the_way_of_the_mouse():
    assert dragged(VIEW, (100, 100), (107, 90)).orbit == HOME.pulled(7, -10)
    assert dragged(VIEW, (100, 100), (50, 60), (107, 90)).orbit == HOME.pulled(7, -10)
    twice = dragged(dragged(VIEW, (100, 100), (107, 90)), (0, 0), (0, 20))
    assert twice.orbit == HOME.pulled(7, 10)
    assert twice.grip is None
    assert drag(VIEW, (5, 5)) == VIEW  # the mouse holds nothing


def test_dragging_there_and_back_is_no_click():
    back = dragged(VIEW, (100, 100), (300, 40), (100, 100))
    assert back == VIEW
    assert back.pixel is None


def test_a_hand_that_trembles_clicks():
    trembled = dragged(VIEW, (100, 100), (100 + SLACK, 100 - SLACK))
    assert trembled == click(VIEW, (100, 100))
    assert dragged(VIEW, (100, 100), (100, 100 + SLACK + 1)).pixel is None
    assert release(VIEW) == VIEW


def test_dragging_and_the_wheel_take_away_what_lies_over_the_picture():
    for over in (press(VIEW, "?"), click(VIEW, (3, 4)), press(VIEW, "q"), press(VIEW, "s")):
        for after in (dragged(over, (0, 0), (50, 0)), wheel(over, 1)):
            assert (after.pixel, after.help, after.note, after.wish) == (None, False, "", "")
    assert grip(press(VIEW, "?"), (0, 0)).help  # not before it is known whether it is a drag
    saved = press(VIEW, "s")
    for after in (grip(saved, (0, 0)), drag(saved, (0, 0)), release(saved), click(saved, (0, 0)), wheel(saved, 1)):
        assert after.wish == ""


def test_the_wheel_counts_notches_also_during_a_drag():
    assert wheel(wheel(VIEW, 2), -3).orbit == Orbit(nearer=-1)
    assert wheel(VIEW, 10**6).orbit == Orbit(nearer=FARTHEST)
    during = drag(wheel(drag(grip(VIEW, (0, 0)), (9, 0)), 2), (20, 0))
    assert during.orbit == Orbit(right=20, nearer=2)


def test_c_returns_to_the_files_own_view_and_says_so_if_it_is_there():
    moved = wheel(dragged(VIEW, (0, 0), (50, 60)), 4)
    assert press(moved, "c") == VIEW
    assert press(VIEW, "c").note == "this is the file's own view"
    assert press(drag(grip(VIEW, (0, 0)), (50, 60)), "c") == VIEW


@pytest.mark.parametrize("key", ["1", "2", "]", "["])
def test_a_scene_is_first_seen_as_its_file_says(key):
    held = drag(grip(VIEW, (0, 0)), (50, 60))
    after = press(held, key)
    assert after.orbit == HOME
    assert drag(after, (90, 90)).orbit == HOME  # the mouse has let go of the scene before


@pytest.mark.parametrize("key", ["n", "\t", "m", "r", "s", "?", "9"])
def test_other_keys_leave_the_camera(key):
    moved = wheel(dragged(VIEW, (0, 0), (50, 60)), 4)
    assert press(replace(moved, scenes=SCENES[:4]), key).orbit == moved.orbit


places = st.tuples(st.integers(-500, 500), st.integers(-500, 500))
steps = st.one_of(
    st.sampled_from(ALL_KEYS).map(lambda key: lambda view: press(view, key)),
    st.characters().map(lambda key: lambda view: press(view, key)),
    places.map(lambda place: lambda view: grip(view, place)),
    places.map(lambda place: lambda view: drag(view, place)),
    st.just(release),
    st.integers(-20, 20).map(lambda notches: lambda view: wheel(view, notches)),
)


@given(st.integers(1, 14), st.lists(steps))
def test_any_sequence_of_keys_and_the_mouse_leaves_a_valid_view(number, some):
    view = View(SCENES[:number])
    for step in some:
        view = step(view)
        assert is_valid(view)


def test_the_markdown_table_has_every_row():
    table = keys_as_markdown().splitlines()
    assert len(table) == 2 + len(KEYS)
    assert all(line.count("|") == 3 for line in table)


def test_a_goes_through_the_numbers_of_samples():
    view = View(SCENES, stage="full")
    seen = []
    for _ in range(5):
        seen.append(view.samples_of_stage)
        view = press(view, "a")
    assert seen == [1, 4, 16, "adaptive", 1]
    view = press(View(SCENES, stage="edges"), "a")
    assert (view.samples_of_stage, view.note) == (1, "stage edges has one sample a pixel")
    assert press(view, "f").samples_of_stage == 4
