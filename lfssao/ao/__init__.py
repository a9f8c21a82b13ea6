"""Ambient occlusion from a view's textures, merge, blur and shading (LF sections 4 to 7)."""
