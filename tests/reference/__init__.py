"""An implementation of lfssao's specification that imports nothing of lfssao."""
