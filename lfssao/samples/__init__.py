"""Sample sets on the square, the sphere, the ball and the disk: functions of (n, seed), with equal bits everywhere.

``__init__.pyi`` has the names, which are imported when they are first used: a render with LF's samples loads nothing
else.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
