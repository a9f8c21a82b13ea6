"""Nearly all of lfssao again in plain Python, from the kit's specification, importing nothing of lfssao."""
