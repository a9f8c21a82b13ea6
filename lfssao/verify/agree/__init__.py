"""Measure how well views agree on the occlusion of a shared surface."""
