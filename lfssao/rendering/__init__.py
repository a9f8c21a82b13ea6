"""The order of the passes, and jobs of many views with their files (LF section 7).

``settings`` and ``views`` say what is rendered, ``passes`` is the order of the passes of a view, ``plan`` lists work
left out. A ``job`` is many views, moved by ``animation``; ``run`` renders them, here or on a ``cluster``, as far as
memory allows. ``output`` writes each view, and the ``contact`` sheet and ``manifest`` of a frame. ``folder`` reads
files back, and ``viewer`` composes what an eye sees.
"""
