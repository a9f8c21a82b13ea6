"""The two identities of VO's section 4, on scenes drawn at random."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from papers_common import Scale
from papers_vo import occlusion
from papers_vo_volume import RADIUS, boxes, floor_of, rays

SMALL = Scale(True)


@settings(max_examples=4, deadline=None)
@given(st.floats(RADIUS, 1.0), st.floats(-2.0, -0.5), st.floats(0.5, 2.0))
def test_volume_is_rays_where_every_ray_meets_one_solid(height, back, end):
    """Before a box that is as thick as R, and wider; what a ray enters it does not leave within R."""
    mesh, buffers = boxes(SMALL, ((-end - 1, back, 0), (end + 1, 0, height)))
    floor = floor_of(buffers, RADIUS)
    difference = (occlusion("vo-lines-normal", buffers, RADIUS, 64) - rays(mesh, buffers, "uniform", "cubic"))[floor]
    assert np.abs(difference.mean()) < 0.01
    assert np.sqrt(np.mean(difference**2)) < 0.025


@settings(max_examples=10, deadline=None)
@given(st.floats(0.05, 0.4), st.floats(0.1, 0.4), st.floats(0.1, 0.4))
def test_volumes_of_two_solids_add_up(gap, first, second):
    """Two boxes side by side, neither of which hides the other from the viewer."""
    objects = ((-1, -0.3, 0), (-gap, 0, first)), ((gap, -0.3, 0), (1, 0, second))
    seen = [boxes(SMALL, *each)[1] for each in (objects, objects[:1], objects[1:], ())]
    floor = np.all([floor_of(b, RADIUS) for b in seen], axis=0)
    both, left, right, neither = (occlusion("vo-lines-normal", b, RADIUS, 64) for b in seen)
    assert (np.minimum(left, right) - neither)[floor].max() > 0.005
    assert np.abs(both - (left + right - neither))[floor].max() < 1e-5
