"""Stiff and extreme cases against exact arithmetic.

``cases`` lists them, with ``scalar_cases`` and ``refusals``; ``inputs`` makes their points and textures. ``exact`` maps
points step by step on the numbers of ``running_error``, an exact value and an error bound each, and ``measure``
compares the kernels with both. ``table`` has the rows and verdicts, ``report`` prints them, ``sequences`` follows two
formulas towards a slit.
"""
