"""An estimator that nothing here knows, in forty lines, and its shader: judged at the first run, its bugs found."""

from pathlib import Path

import ao_shaders
import pytest
from jobs import render

from lfssao.ao.estimators.registry import ESTIMATORS

TEXT = Path(ao_shaders.__file__).with_name("planted_spiral.py")
BUGS = {
    "falls off slower": ((r"-DECAY \*", "-0.5 * DECAY *"), "decay"),
    "falls off with the distance": (
        (r"DECAY \* dot\(v, v\) / \(radius \* radius\)", "DECAY * length(v) / radius"),
        None,
    ),
    "spiral of another angle": ((r"GOLDEN = 0\.76", "GOLDEN = 0.67"), None),
    "below the tangent plane, too": ((r"max\(0\.0, dot\(v, n\)\)", "abs(dot(v, n))"), None),
    "without the half": ((r"float\(k\) \+ 0\.5", "float(k) + 1.0"), None),
}


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ESTIMATORS, "data", dict(ESTIMATORS.data))
        words = "corner", "--camera", "--resolution", "96x72", "--radii", "8%", "--estimator", str(TEXT)
        folder = tmp_path_factory.mktemp("spiral") / "reference"
        yield ao_shaders.Frame(render(folder, *words, "--layers", "depth,positions,normals,ao"))


def test_the_shader_conforms_to_its_text(context, frame, tmp_path):
    assert len([line for line in TEXT.read_text().splitlines() if line]) <= 40
    report, result = ao_shaders.judged(context, "spiral", frame, tmp_path / "mine", {})
    assert report.exit_code == 0, result
    assert frame.textures["ao_1"].max() > 0.1


@pytest.mark.parametrize("bug", BUGS)
def test_its_bugs_are_found(context, frame, tmp_path, bug):
    change, cause = BUGS[bug]
    report, result = ao_shaders.judged(context, "spiral", frame, tmp_path / "mine", {}, change)
    assert report.exit_code == 2
    if cause is None:
        assert not result.diagnosis.fits, result.diagnosis.words("M")
    else:
        assert result.diagnosis.fits
        assert result.diagnosis.candidates[0].kind == cause
