"""Options that a diagnosis advises: the command line takes each, and it gives the value that explains the texture."""

import pytest

from lfssao.cli.main import command_line
from lfssao.samples import ROTATIONS
from lfssao.verify.diagnosis.change import advice
from lfssao.verify.diagnosis.hints import parameter_option, rotation_option, scaled_parameter_option, scaled_text
from lfssao.verify.diagnosis.sampling import other_turns


@pytest.mark.parametrize(
    ("option", "pair"),
    [
        (parameter_option("border", "clamp"), ("border", "clamp")),
        (parameter_option("half", True), ("half", "true")),
        (parameter_option("directions", 8), ("directions", "8")),
        (parameter_option("bias", 0.0123456), ("bias", "0.01235")),
        (scaled_parameter_option("power", 1.5, (0.0, 8.0), 2.0), ("power", "3")),
        (scaled_parameter_option("power", 1.5, (0.0, 2.0), 2.0), ("power", "2")),
    ],
)
def test_render_reads_an_advised_parameter(option, pair):
    assert command_line().parse_args(["render", "statue", *option.split()]).parameter == [pair]


@pytest.mark.parametrize("factor", [0.5, 1.3, 1.01234567, 1.000345678, 1 - 1e-5])
@pytest.mark.parametrize("value", [1.0, 1.5, 0.07])
def test_an_advised_number_is_off_by_as_much_as_the_renderers(value, factor):
    """A texture off by a factor that four digits do not show would be rendered as before."""
    assert float(scaled_text(value, factor)) / value - 1 == pytest.approx(factor - 1, rel=5e-3)
    (_, text), *_ = (
        command_line()
        .parse_args(["render", "statue", *scaled_parameter_option("power", value, (0.0, 8.0), factor).split()])
        .parameter
    )
    assert text == scaled_text(value, factor)


@pytest.mark.parametrize("own", ["none", "hash"])
def test_each_rotation_that_explains_a_texture_is_advised(own):
    changes = [words for words, _ in other_turns(own, 0, 8, 8)]
    advised = [rotation_option(words) for words in changes if rotation_option(words)]
    assert advised == [f"--rotate {name}" for name in ROTATIONS if name not in ("none", own)]
    for option in advised:
        assert command_line().parse_args(["render", "statue", *option.split()]).rotate == option.split()[1]


def test_advice_says_which_command_takes_the_option():
    assert advice("--map a=1-a") == "; compare again with --map a=1-a"
    assert advice("--rotate none") == "; render the reference with --rotate none"
    assert advice("") == ""
