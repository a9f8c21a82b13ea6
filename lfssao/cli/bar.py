"""Progress bars that never stand, and on them the kernels that are being compiled."""

import threading
from contextlib import AbstractContextManager
from typing import Any

from tqdm import tqdm

from lfssao.core.jit import report_compiling

_EXPECTED = 24  # kernels that a render of a display compiles; other commands compile more, or fewer
_shown: list["Bar"] = []


class Bar(tqdm):  # type: ignore[misc]
    """A bar of tqdm that is drawn twice a second, so that its time goes on while a step takes long."""

    def __init__(self, *items: Any, **more: Any) -> None:
        super().__init__(*items, **more)
        self._over = threading.Event()
        if not self.disable:
            _shown.append(self)
            threading.Thread(target=self._tick, daemon=True).start()

    def _tick(self) -> None:
        while not self._over.wait(0.5):
            self.refresh()

    def close(self) -> None:
        """As of tqdm."""
        if self in _shown:
            _shown.remove(self)
            self._over.set()
        super().close()


def compiling() -> AbstractContextManager[None]:
    """In the block, say on the last bar, or on a line of its own, which kernel is being compiled."""
    line: list[Bar] = []

    def begin(number: int) -> None:
        of = f"/{_EXPECTED}" if number <= _EXPECTED else ""
        text = f"compiling kernels (first run only) {number}{of}"
        if _shown:
            _shown[-1].set_postfix_str(text)
        else:
            line.append(Bar(desc=text, bar_format="{desc} {elapsed}", leave=False))

    def end() -> None:
        if line:
            line.pop().close()
        elif _shown:
            _shown[-1].set_postfix_str("", refresh=False)

    return report_compiling(begin, end)
