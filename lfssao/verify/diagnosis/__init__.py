"""Which single change of the reference explains a texture that is outside its interval."""
