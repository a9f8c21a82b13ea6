"""Benches: what the implementation gets right, and what that costs."""
