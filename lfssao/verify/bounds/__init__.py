"""Intervals of what other renderers may compute, stage by stage."""
