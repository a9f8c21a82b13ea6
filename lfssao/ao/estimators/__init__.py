"""Estimators of ambient occlusion by name."""
