"""Displays and cameras: spaces, rays and the projection world -> image (LF section 3)."""
