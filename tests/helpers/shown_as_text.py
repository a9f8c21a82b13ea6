"""Pictures in words: imported by a kernel, it has a notebook's text say what each figure is to show."""

from IPython import get_ipython
from matplotlib.figure import Figure

import lfssao
from lfssao.samples import SampleSet


def words(figure):
    """The titles of a figure, and of each of its axes titles, labels, legend, and that its lengths are stretched."""
    parts = [[f"figure of {len(figure.axes)} axes"], [figure.get_suptitle(), *texts(*figure.legends)]]
    for axes in figure.axes:
        legends = [axes.get_legend()] if axes.get_legend() else []
        labels = [axes.get_xlabel(), axes.get_ylabel()]
        units = {label.rpartition(", ")[2] for label in labels}
        measured = bool(axes.get_images()) or units in ({"texels"}, {"metres"})
        looks = ["stretched"] if measured and axes.get_aspect() != 1 else []
        parts.append([axes.get_title(), *labels, *texts(*legends), *looks])
    return "\n".join("; ".join(filter(None, part)) for part in parts if any(part))


def texts(*legends):
    return [text.get_text() for legend in legends for text in legend.get_texts()]


def register():
    Figure.__repr__ = words  # '%matplotlib inline' takes away what is registered for it
    formatter = get_ipython().display_formatter.formatters["text/plain"]
    for shown in (SampleSet, *(getattr(lfssao, name) for name in lfssao.__all__)):
        if any(hasattr(shown, name) for name in ("_facts", "_repr_png_", "_repr_html_")):  # numbers would fill pages
            formatter.for_type(shown, lambda thing, printer, _: printer.text(type(thing).__name__))


register()
