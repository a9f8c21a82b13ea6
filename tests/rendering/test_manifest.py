"""Digests of arrays are those of their numbers, row by row and little-endian; sizes of views are those of a display."""

import hashlib
import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from lfssao import Mesh, Paint, find_display
from lfssao.rendering.manifest import describe_scene, digest, display_of

NUMBERS = np.random.default_rng(3).random((24, 32, 3), np.float32)


@pytest.mark.parametrize(
    "array", [NUMBERS, NUMBERS[:, ::-1].transpose(1, 0, 2), NUMBERS.astype(">f4"), NUMBERS[:0], np.arange(5)]
)
def test_a_digest_is_of_the_numbers_row_by_row(array):
    text = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
    assert digest(array) == hashlib.sha256(text).hexdigest()
    assert digest(array.copy()) == digest(array)


def test_the_digest_of_colours_is_of_samplers_too_where_there_are_any():
    image = np.ones((2, 2, 3), np.float32)
    one = np.zeros(1, np.int32)
    paint = Paint(np.ones((1, 3), np.float32), one, (image,), np.zeros((3, 2)))
    arrays = [paint.factors, one, paint.uv, None, image]
    sums = [None if each is None else [list(each.shape), digest(each)] for each in arrays]
    found = []
    for samplers in (None, (("clamp", "repeat", False),), (("clamp", "repeat", True),)):
        mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]), replace(paint, samplers=samplers))
        found.append(describe_scene(mesh)["paint_sha256"])
    assert found[0] == hashlib.sha256(json.dumps(sums).encode()).hexdigest()
    assert len(set(found)) == 3


def test_views_of_two_sizes_are_not_those_of_a_display():
    values = asdict(find_display("sample-a"))
    entries = {k: {"view": {"width": width, "height": 9}} for k, width in enumerate((16, 17))}
    with pytest.raises(ValueError, match="the sizes of its views are not those of the display's modules"):
        display_of(values, entries)
    small = display_of(values, {0: entries[0]})
    assert {(module.width, module.height) for module in small.modules} == {(16, 9)}
