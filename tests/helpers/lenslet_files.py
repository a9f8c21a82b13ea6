"""The file of a small lenslet display, of 5 x 3 lenses, whose outer images are cut."""

LENSES = """kind = "lenslet"
name = "small"
resolution = [40, 30]
panel_width = 0.04
panel_height = 0.03
lens_pitch = 0.01125
image_pitch = 0.012
gap = 0.02
focal_length = 0.021
observer_distance = 0.3
roi = {min = [-0.04, -0.04, 0.05], max = [0.04, 0.04, 0.15]}
"""
