"""Figures of single concepts, and the numbers behind them: what the notebooks show. Each returns a matplotlib Figure.

matplotlib is imported by the functions that draw: it takes a second.
"""
