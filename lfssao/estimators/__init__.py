"""Estimators of ambient occlusion: one file a family, one registry, one call (``registry.estimate``)."""
