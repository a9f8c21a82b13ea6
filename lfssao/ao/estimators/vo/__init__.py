"""Volumetric Obscurance (Loos, Sloan 2010)."""
