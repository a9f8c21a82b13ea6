"""Kernels of the diagnosis."""
