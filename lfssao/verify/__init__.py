"""The oracle for other renderers."""
