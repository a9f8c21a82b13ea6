"""Error against run time, of every estimator.

``settings`` lists the things to measure; ``scene`` has the view, its textures and ray-cast occlusion; ``references``
the textures with many samples; ``setting_times`` the times; ``run`` measures all of it for a JSON file. From that file
alone ``advise`` picks settings, ``slopes`` fits exponents, ``page`` and ``plot`` show the points.
"""
