"""Scenes: triangle meshes in world space, from files or made by the program."""
