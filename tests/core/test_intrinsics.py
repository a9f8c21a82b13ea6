"""Kernels run as plain Python, by which a reader steps through them, with the same bits."""

from jobs import digests_of, python, render

COMMAND = ["corner", "--camera", "--resolution", "8x6", "--radii", "0.3", "--samples", "3"]


def test_textures_without_compiler_have_the_same_bits(tmp_path):
    words = ["render", *COMMAND, "-o", str(tmp_path / "plain")]
    script = "import sys, numba, lfssao.cli.main as m; assert numba.config.DISABLE_JIT; sys.exit(m.main(sys.argv[1:]))"
    done = python("-c", script, *words, NUMBA_DISABLE_JIT="1")
    assert done.stderr == ""
    plain = digests_of(tmp_path / "plain")
    assert plain
    assert plain == digests_of(render(tmp_path / "compiled", *COMMAND))
