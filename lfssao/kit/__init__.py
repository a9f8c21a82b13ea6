"""Conformance cases to hand over: inputs, expected outputs, bounds and a specification that stands on its own."""
