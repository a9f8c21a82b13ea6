"""The oracle for other renderers.

    case, verdict, judge   one problem with its solution, and the judgement of a renderer's textures
    bounds                 intervals in which every conforming float32 renderer falls, stage by stage
    compare                folders and files of two renderers, matched, judged and reported
    kit                    small cases of every stage, their specification, and the folder that holds them
    testing                an assertion, a pytest plugin and hypothesis strategies for other projects

The formulas of an estimator (``lfssao.ao.formulas``) give its intervals, too (``bounds.points``).
"""
