"""Error against run time, of every estimator."""
