"""Benches of the command ``lfssao bench``: error against run time, numerical stability."""
