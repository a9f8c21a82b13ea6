"""Other renderers' textures against a reference."""
