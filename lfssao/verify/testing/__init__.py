"""Assertions, strategies and the pytest plugin."""
