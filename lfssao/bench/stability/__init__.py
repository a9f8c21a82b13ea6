"""Stiff and extreme cases against exact arithmetic, and of estimators against float64.

``cases`` lists them, with ``scalar_cases``; ``inputs`` makes their points and textures. ``exact`` maps points step by
step on the numbers of ``running_error``, an exact value and an error bound each, and ``measure`` compares the kernels
with both. ``conditions`` compares every estimator's float32 with its float64. ``table`` has the rows and verdicts,
``report`` prints and draws them.
"""
