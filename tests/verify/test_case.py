"""Cases: problems with their solutions, as the kit makes them."""

import lfssao
from lfssao.testing import make_case


def test_a_case_of_the_kit_is_the_public_class_and_its_first_output_counts():
    case = make_case("frame")
    assert isinstance(case, lfssao.Case)
    assert next(iter(case.outputs)) == "shaded"
    assert set(case.bounds) <= set(case.outputs)
