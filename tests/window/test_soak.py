"""A short one; `soak.py` is the long one."""

from soak import soak


def test_keys_faster_than_pictures_for_a_while(display, tmp_path):
    outcome = soak(display, tmp_path, 400)
    assert outcome.status == 0
    assert outcome.changes == 400
