"""The benchmarks of ``benchmarks/``: baselines have lfssao's bits, papers' tables their own sums."""

import bench_algorithm2
import bench_baselines
import bench_paper_tables as papers
import numpy as np
import pytest
from c_baselines import compile_baselines

from lfssao import find_display

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def small_case():
    return bench_algorithm2.gallery_case(64, 48)


@pytest.mark.slow
def test_c_has_the_bits_of_algorithm_2(small_case, tmp_path):
    """The bench ends with a sentence where a bit differs."""
    library = compile_baselines(tmp_path, 1, "-ffp-contract=off")
    rows = bench_algorithm2.bench(small_case, library, library, 1)
    assert set(rows) >= {"lfssao", "plain_c"}
    assert 0.1 < bench_algorithm2.ours(small_case)().mean() < 0.5


@pytest.mark.slow
def test_a_shader_has_the_bits_of_algorithm_2(small_case):
    assert bench_baselines.glsl(small_case, 1)["glsl"]["equal_bits"] == 1.0


def test_spread():
    assert papers.spread_per_cent([9.0, 10.0, 11.0]) == pytest.approx(20)
    theirs = [after - before for before, after in papers.LF_MILLISECONDS.values()]
    assert theirs == pytest.approx([6.46, 6.43, 6.48])
    assert papers.spread_per_cent(theirs) == pytest.approx(0.774, abs=0.001)


def test_models_are_brought_to_equal_cover(monkeypatch):
    """Statue and ammonite, small: as shown they cover different parts of the picture."""
    monkeypatch.setattr(papers, "MODELS", ("statue", "ammonite"))
    small = find_display("virtual").with_resolution(128, 96)
    monkeypatch.setattr(papers, "find_display", lambda _name: small)
    table = papers.face_counts(1, 1)
    shown, equal = ([row["cover"] for row in table[key]["rows"]] for key in ("as shown", "at equal cover"))
    assert max(shown) > 2 * min(shown)
    assert equal == pytest.approx([min(shown)] * 2, rel=0.02)
    for row in table["as shown"]["rows"]:
        assert row["ns_per_covered_texel"] == pytest.approx(1e6 * row["ssao_ms"] / (row["cover"] * 128 * 96))
        assert row["with_ms"] == row["without_ms"] + row["ssao_ms"]


def test_the_papers_tables_are_their_own():
    """Sums and ratios that the papers print."""
    sao = papers.SAO_MILLISECONDS
    for whole in ("Alchemy", "SAO"):
        parts = [ms for name, ms in sao.items() if name.startswith(whole) and not name.endswith("total")]
        assert sum(parts) == pytest.approx(sao[f"{whole}, total"])
    assert sao["Alchemy, total"] / sao["SAO, total"] == pytest.approx(7.1, abs=0.05)
    columns = (0.71, 0.71, 0.54, 0.59), (1.01, 1.03, 0.77, 0.82), (1.18, 1.31, 1.14, 0.97), (3.11, 3.55, 2.32, 2.52)
    means = [np.mean(column) for column in columns]
    assert list(papers.VO_MILLISECONDS.values())[:4] == pytest.approx(means, abs=0.006)


def test_a_papers_table_has_ratios_and_orders():
    warm = {"a": np.array([2.0, 2.0, 9.0]), "b": np.array([1.0, 1.0, 1.0])}
    table = papers.beside(warm, {"a": 10.0, "b": 30.0})
    assert [(row["ratio"], row["paper_ratio"]) for row in table["rows"]] == [(1, 1), (0.5, 3)]
    assert table["orders"] == [["b", "a"], ["a", "b"]]
