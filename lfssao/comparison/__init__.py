"""Textures of another renderer against a reference: read, matched by name, measured, judged, reported."""
