"""The order of the passes, and jobs of many views with their files."""
