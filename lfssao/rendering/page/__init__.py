"""The page on which an eye walks along a rendered display: what it holds, its text, style, script and shader."""
