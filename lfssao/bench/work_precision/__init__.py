"""Error against run time, of every estimator.

``settings`` lists the things to measure; ``scene`` has a view, its textures and ray-cast occlusion; ``figures`` are
those of textures; ``run`` measures all for a JSON file. From it alone ``advise`` picks settings, ``slopes`` fits
exponents, ``page`` and ``plot`` show the points.
"""
