"""Arithmetic that is the same on every machine, and files that are whole or absent."""
