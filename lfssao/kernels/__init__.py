"""The numba layer: functions of arrays and scalars only, which import nothing from the rest of lfssao.

Everything here is made of IEEE 754 ``+ - * / sqrt``, compares and conversions in a written order, so its results
have equal bits on every CPU and for every number of threads.
"""
