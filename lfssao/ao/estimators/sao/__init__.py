"""Scalable Ambient Obscurance (McGuire, Mara, Luebke 2012)."""
