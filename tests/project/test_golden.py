"""No texture changes: SHA-256 digests of what the program itself made before it was rearranged.

The digests are the program's own output, not an independent expectation: they say that bits stay, not that they are
right. ``python tests/helpers/golden.py`` prints them anew; they change only in a commit whose message says why.
"""

import json

import pytest
from golden import GOLDEN, GROUPS, digests_of


@pytest.mark.filterwarnings("ignore:radius 1e-07 is less than half a texel")
@pytest.mark.parametrize("group", GROUPS)
def test_no_texture_changes(group):
    expected = json.loads(GOLDEN.read_text())[group]
    found = {name: digests_of(textures) for name, textures in GROUPS[group]()}
    assert found.keys() == expected.keys()
    for name, textures in found.items():
        different = [layer for layer in expected[name] if textures.get(layer) != expected[name][layer]]
        assert textures == expected[name], f"{name}: {', '.join(different)}"
