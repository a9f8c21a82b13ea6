"""Objects that notebooks show as a figure, which stand on floors that draw nothing."""

from typing import Any

from IPython import get_ipython

from lfssao.files.pictures import figure_png


def show_figures() -> None:
    """Let the notebook that runs, if there is one, show displays and sample sets as their figures."""
    shell = get_ipython()
    if shell is None:
        return
    pictures = shell.display_formatter.formatters["image/png"]
    pictures.for_type_by_name("lfssao.optics.display", "Display", display_png)
    pictures.for_type_by_name("lfssao.samples.sets", "SampleSet", samples_png)


def display_png(display: Any) -> bytes:
    """Return the drawing of a display as a PNG file."""
    from lfssao.viz.display import draw_display  # late: matplotlib takes a second to import

    return figure_png(draw_display(display))


def samples_png(samples: Any) -> bytes:
    """Return the figure of a sample set as a PNG file."""
    from lfssao.viz.samples import draw_samples  # late: matplotlib takes a second to import

    return figure_png(draw_samples([samples]))
