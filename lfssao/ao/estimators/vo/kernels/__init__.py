"""Kernels: numba functions of arrays and scalars."""
