"""Starts for estimators of one's own, which ``lfssao estimators --template`` prints."""
