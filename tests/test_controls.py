"""Keys change the View, and nothing else does; no window is needed to try them all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from raytracer import METHODS, STAGES
from sketch.controls import KEYS, SCENE_KEYS, View, click, keys_as_markdown, press

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


@given(st.integers(1, 14), st.lists(st.one_of(st.sampled_from(ALL_KEYS), st.characters())))
def test_any_sequence_of_keys_leaves_a_valid_view(number, keys):
    view = View(SCENES[:number])
    for key in keys:
        view = press(view, key)
        assert is_valid(view)


def test_the_markdown_table_has_every_row():
    table = keys_as_markdown().splitlines()
    assert len(table) == 2 + len(KEYS)
    assert all(line.count("|") == 3 for line in table)
