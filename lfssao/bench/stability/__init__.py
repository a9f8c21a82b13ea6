"""Stiff and extreme cases against exact arithmetic."""
