"""First hits of texels' rays: depth, positions, normals and albedo (LF section 7, passes 1 and 2)."""
