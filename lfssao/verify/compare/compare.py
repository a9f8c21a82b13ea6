"""Compare another renderer's textures with a reference: the function of the package."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from lfssao.core.arguments import as_number
from lfssao.errors import InputError, check_type, shown
from lfssao.verify.compare.comparison import Comparison
from lfssao.verify.compare.files import Files
from lfssao.verify.compare.report import Report
from lfssao.verify.compare.result import Tolerance


def compare(
    mine: str | Path,
    reference: str | Path,
    *,
    rules: Mapping[str, str] | None = None,
    layers: Sequence[str] | None = None,
    cases: Sequence[str] | None = None,
    exact: bool = False,
    fail: float = 0.0,
    fail_percent: float = 0.0,
    model: str = "shader",
    mesh: str | None = None,
    diagnosis: bool = True,
    page: bool = False,
    stored: Mapping[str, str] | None = None,
    files: Files = (),
    background: float | None = None,
) -> Report:
    """Compare another renderer's textures with a reference.

    Parameters
    ----------
    mine, reference : str or Path
        Two folders or two files; EXR, TIFF, PNG or NPY. Intervals are known where ``lfssao render`` wrote the latter.
    rules : mapping, optional
        Layers or channels of the reference, or '1-merged' for visibility, each with the other renderer's name of it.
    layers : sequence of str, optional
        Compare these layers of the reference only; 'ao' stands for those of all radii.
    cases : sequence of str, optional
        Compare these cases of a kit only.
    exact : bool
        Whether all but equal bits fails.
    fail, fail_percent : float
        A texel beyond its interval fails only if it differs from the reference by more than ``fail``, in the texture's
        unit, or in codes; a texture only if more than ``fail_percent`` of its texels fail. Not with ``exact``.
    model : str
        Limits of the renderer's arithmetic (``lfssao.verify.bounds.error_model.MODELS``).
    mesh : str, optional
        File of the mesh that the reference was rendered of, which judges depth and colour; embedded scenes need none.
    diagnosis : bool
        Whether a search names the change of the reference that explains a wrong texture of a rendered view.
    page : bool
        Whether the report keeps textures for ``write_html``.
    stored, files : mappings, optional
        Formats of layers, and layers by patterns of files' names, as ``--stored`` and ``--files`` have them.
    background : float, optional
        Value of the other renderer's depth and positions where there is no surface; infinity by default.

    Returns
    -------
    Report
        True, its ``exit_code`` 0, where everything conforms.

    Raises
    ------
    InputError
        If there is nothing to compare, or the manifest or an argument is wrong; faults of files are in the report.

    Examples
    --------
    >>> np.save("mine.npy", np.float32([[0.5]]))
    >>> np.save("reference.npy", np.float32([[0.25]]))
    >>> lfssao.compare("mine.npy", "reference.npy").exit_code
    2
    """
    for name, value in (("mine", mine), ("reference", reference), ("mesh", mesh)):
        check_type(name, value, str | Path | None if name == "mesh" else str | Path)
    for name, texts in (("layers", layers), ("cases", cases)):
        _check_texts(name, () if texts is None else texts)
    for name, mapping in (("rules", rules), ("stored", stored)):
        check_type(name, {} if mapping is None else mapping, Mapping)
        _check_texts(name, () if mapping is None else (*mapping, *mapping.values()))
    if not isinstance(files, str):
        _check_texts("files", (*files, *files.values()) if isinstance(files, Mapping) else files)
    tolerance = Tolerance(fail, fail_percent)
    if background is not None and np.isnan(as_number(background)):
        raise InputError("background is NaN, it must be a number")
    options = cases, tolerance, mesh, diagnosis, page, stored, files, background
    comparison = Comparison(Path(mine), Path(reference), rules or {}, layers, exact, model, *options)
    for module in comparison.modules:
        comparison.add(module)
    return comparison.report()


def _check_texts(argument: str, texts: object) -> None:
    """Refuse all but a sequence of texts: a text itself would be taken letter by letter."""
    if isinstance(texts, str) or not isinstance(texts, Sequence) or not all(isinstance(text, str) for text in texts):
        raise InputError(f"{argument} is {shown(texts)}, it must be a list of texts")
