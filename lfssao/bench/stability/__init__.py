"""Stiff and extreme cases against exact arithmetic, and of estimators against float64.

``cases`` lists them, with ``scalar_cases``; ``inputs`` makes their points and textures. ``tracked`` has numbers with an
exact value and an error bound each, on which ``exact`` runs the formulas of mappings and estimators. ``measure``
compares the kernels of Algorithms 1 and 2 with them, ``occlusions`` the estimators. ``conditions`` compares every
estimator's float32 with its float64. ``table`` has the rows and verdicts, ``report`` prints and draws them.
"""
