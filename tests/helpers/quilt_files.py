"""The file of a small quilt, of two rows of three views."""

QUILT = """kind = "quilt"
name = "small"
columns = 3
rows = 2
resolution = [24, 32]
aspect = 0.75
screen_height = 0.16
field_of_view = 14
view_cone = 35
roi = {min = [-0.05, -0.07, -0.04], max = [0.05, 0.07, 0.04]}
"""
