"""Ambient occlusion from a view's textures, merge, blur and shading (LF sections 4 to 7)."""

from lazy_loader import attach

__getattr__, __dir__, _ = attach(__name__, ["reference"])
