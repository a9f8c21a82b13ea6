"""The oracle for other renderers: what is right at each texel, and what rounding may change.

error_model.MODELS              what float32 arithmetic may do, by name: shader, sampler, nearest, strict
bounds.ao_bounds                acceptance intervals: Bounds(lower, upper, undecided) of Algorithms 1 and 2
bounds.merge_bounds, blur_bounds, shade_bounds      of the later stages
explain.explain                 why each sample of a texel falls as it does
"""
