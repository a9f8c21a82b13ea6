"""Buffers of a view: sizes and dtypes that do not fit are refused."""

import numpy as np
import pytest

from lfssao import Buffers, Camera, InputError

VIEW = Camera("orthographic", (0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2.0, 1.0, 9.0).view(4, 3)
DEPTH = np.zeros((3, 4), np.float32)
PLACES = np.zeros((3, 4, 3), np.float32)


@pytest.mark.parametrize(("textures", "words"), [
    ((DEPTH.T, PLACES), "depth has shape"),
    ((DEPTH.astype(int), PLACES), "depth is of int"),
    ((DEPTH, PLACES[:2]), "positions"),
    ((DEPTH, PLACES.astype(np.float64)), "positions"),
    ((DEPTH, PLACES, PLACES[..., :2]), "normals"),
    (([[0.0]], PLACES), "depth is of list"),
    ((np.broadcast_to(np.float32(0), (2**16, 2**15)), PLACES), "depth has 2147483648 texels, a texture has at most"),
])  # fmt: skip
def test_textures_that_do_not_fit_are_refused(textures, words):
    with pytest.raises(InputError, match=words):
        Buffers(VIEW, *textures)


@pytest.mark.parametrize(("neighbour", "words"), [
    (VIEW.world_to_image, "neighbour 1 is WorldToImage"),
    ((VIEW, DEPTH), "mapping of neighbour 1 is of type View"),
    ((VIEW.world_to_image, PLACES), "depth of neighbour 1 has shape"),
    ((VIEW.world_to_image, DEPTH.astype(float)), "depth of neighbour 1 is of float64, expected float32"),
    ((VIEW.world_to_image, np.full((2, 2), np.nan, np.float32)), "depth of neighbour 1 is NaN"),
])  # fmt: skip
def test_neighbours_that_are_none_are_refused(neighbour, words):
    with pytest.raises(InputError, match=words):
        Buffers(VIEW, DEPTH, PLACES, neighbours=[(VIEW.world_to_image, DEPTH[:2]), neighbour])
