"""Whether views agree on the occlusion of the surface that they share."""
