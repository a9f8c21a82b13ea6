"""The same work by others, measured in turn with ours: C, a shader, a toolkit's renderer, a ray tracing library."""
