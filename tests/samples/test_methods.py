"""The table of all sampling methods, and how each is found."""

import pytest

from lfssao.samples import METHODS, find_method

EVERY = [(domain, name) for domain, methods in METHODS.items() for name in methods]


@pytest.mark.parametrize(("domain", "name"), EVERY)
def test_a_method_is_found_by_domain_and_name(domain, name):
    method = find_method(domain, name)
    assert method is METHODS[domain][name]
    assert (method.domain, method.name) == (domain, name)
