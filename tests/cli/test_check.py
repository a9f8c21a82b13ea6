"""lfssao check: a machine's bits, told in one line."""

import json

import numpy as np

from lfssao.cli.main import main
from lfssao.verify import check


def test_this_machine_has_the_bits(tmp_path, capsys):
    """The digests are the program's own: those of other machines are to be the same."""
    assert main(["check", "--json", str(tmp_path / "a.json")]) == 0
    count = len(check.expected_digests())
    assert count >= 24
    (first,) = capsys.readouterr().out.splitlines()
    assert first.startswith(f"{count} of {count} digests are equal: lfssao ")
    for part in ("numba 0.", "llvmlite 0.", "numpy ", "Linux"):
        assert part in first
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["other"] == []
    assert told["digests"] == check.expected_digests()
    assert main(["check", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out) == told


def test_one_ulp_of_one_texel_is_other_bits(monkeypatch, capsys):
    texture = np.full((4, 5), 0.5, np.float32)
    expected = {"one": check._digest([texture]), "other": check._digest([texture])}
    monkeypatch.setattr("lfssao.cli.check.expected_digests", lambda: expected)
    texture[1, 2] = np.nextafter(texture[1, 2], 1)
    found = {**expected, "other": check._digest([texture])}
    monkeypatch.setattr("lfssao.cli.check.found_digests", lambda: iter(found.items()))
    assert main(["check"]) == 1
    assert capsys.readouterr().out.splitlines()[1] == "other bits: other"
