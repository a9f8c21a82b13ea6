"""The digests of the kit's cases; as a program it writes kit_digests.json anew, after a change that is meant.

A case that changes although nobody meant it is an error: renderers are held to these bits.
"""

import json
import tempfile
from pathlib import Path

from lfssao.verify.kit.cases import RECIPES, make_case
from lfssao.verify.kit.folder import read_index, write_kit

PATH = Path(__file__).with_suffix(".json")


def main():
    with tempfile.TemporaryDirectory() as folder:
        write_kit(Path(folder) / "kit", map(make_case, RECIPES))
        new = {entry["name"]: entry["sha256"] for entry in read_index(Path(folder) / "kit")}
    old = json.loads(PATH.read_text())
    for name in sorted(set(old) | set(new)):
        if old.get(name) != new.get(name):
            print(f"{name}: {'new' if name not in old else 'gone' if name not in new else 'changed'}")
    PATH.write_text(json.dumps(new, indent=1) + "\n")


if __name__ == "__main__":
    main()
