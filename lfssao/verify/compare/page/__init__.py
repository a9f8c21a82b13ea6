"""The page of a comparison: what it keeps of textures, its template, style and script."""
