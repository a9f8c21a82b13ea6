"""Arguments of ``compare`` that mean nothing: each is refused in a sentence that names it."""

from pathlib import Path

import numpy as np
import pytest

import lfssao
from lfssao import InputError

NO_NUMBERS = [np.nan, -1, "0.1", None, True, [0.1], 1j]
NO_LISTS = [5, "merged", ["merged", 5], {"merged"}]

WRONG = [
    *(({"fail": bad}, "--fail: .* is not a number from 0") for bad in NO_NUMBERS),
    *(({"fail_percent": bad}, "--fail-percent: .* is not a number from 0 to 100") for bad in (*NO_NUMBERS, 101)),
    *(({"layers": bad}, "layers is") for bad in NO_LISTS),
    *(({"cases": bad}, "cases is") for bad in NO_LISTS),
    *(({"rules": bad}, "rules is") for bad in (5, "image=ao", ["image"], {"image": 5}, {5: "ao"})),
    *(({"stored": bad}, "stored is") for bad in (5, "image=half", ["image"], {"image": 5}, {5: "half"})),
    *(({"files": bad}, "files is") for bad in (5, None, [5], {"a": 5}, {5: "a"})),
    *(({"mesh": bad}, "mesh is of type") for bad in (5, ["a.obj"])),
    *(({"mine": bad}, "mine is of type") for bad in (5, None, np.zeros((2, 2)))),
    *(({"reference": bad}, "reference is of type") for bad in (5, None, np.zeros((2, 2)))),
    *(({"model": bad}, "there is no error model") for bad in (5, None, ["shader"])),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), WRONG, ids=[words for _, words in WRONG])
def test_what_means_nothing_is_refused(changes, words, tmp_path):
    np.save(tmp_path / "a.npy", np.float32([[0.5]]))
    same = {"mine": tmp_path / "a.npy", "reference": tmp_path / "a.npy"}
    with pytest.raises(InputError, match=words) as caught:
        lfssao.compare(**{**same, **changes})
    assert "\n" not in str(caught.value)


def test_what_is_right_in_another_type_is_taken(tmp_path):
    for name, value in (("a", 0.5), ("b", 0.25)):
        np.save(tmp_path / f"{name}.npy", np.float32([[value]]))
    given = str(tmp_path / "a.npy"), Path(tmp_path / "b.npy")
    assert lfssao.compare(*given, layers=("image",), fail=np.float32(0.5), fail_percent=np.array(1)).exit_code == 1
    assert lfssao.compare(*given, stored={"image": "float"}, rules={}, files=()).exit_code == 2
