"""Error against run time, of every estimator.

``settings`` lists the things to measure; ``scene`` has the view, its textures and ray-cast occlusion; ``references``
textures with many samples; ``setting_times`` times; ``rotations`` errors of turned samples; ``run`` measures all for a
JSON file. From it alone ``advise`` picks settings, ``slopes`` fits exponents, ``page`` and ``plot`` show the points.
"""
