"""Reference screen-space ambient occlusion for light field displays, with equal bits on every machine.

Its names, listed in ``__init__.pyi``, are all there is to know for a start; each is described where it is defined. They
are imported when they are first used, so that ``import lfssao`` itself costs nothing.
"""

import sys

from lazy_loader import attach_stub

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)

if "IPython" in sys.modules:
    from lfssao.viz.notebook import show_figures

    show_figures()
