"""``lfssao estimators``: the estimators of occlusion and their parameters."""

import argparse
from collections.abc import Collection, Iterator
from importlib import resources
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from lfssao.ao.estimators.estimator import Estimator, FloatArray, Value
from lfssao.ao.estimators.published import find_published, published_names, published_text
from lfssao.ao.estimators.registry import ESTIMATORS, check_samples, find_estimator, full_parameters
from lfssao.cli import values
from lfssao.errors import InputError, errors_of
from lfssao.files.image_file import ENDINGS, Size
from lfssao.rendering.settings import drawn_samples

TEMPLATES = "sum", "fold"


def add_to(estimators: argparse.ArgumentParser) -> None:
    """Describe the command and its argument."""
    estimators.description = """List the estimators that 'lfssao render --estimator NAME' knows: what each computes,
        after which paper, its number of samples, its parameters with their defaults. With a NAME say its formula and
        its parameters, or print the file of a published shader that --like knows. With a FILE.py run it, check the
        estimator of one's own that it holds, and say what was found."""
    name = "an estimator whose parameters are explained, or a Python file of one's own, which is run"
    estimators.add_argument("name", nargs="?", metavar="NAME", help=name)
    start = "print a start for a file of one's own: a sum of terms of samples, or a fold of steps along directions"
    estimators.add_argument("--template", choices=TEMPLATES, help=start)
    estimators.set_defaults(run=_list)


def _list(options: argparse.Namespace) -> None:
    if options.template is not None:
        if options.name is not None:
            raise InputError("--template: it prints a file, and a NAME is given")
        print(resources.files("lfssao.ao.estimators.templates").joinpath(f"{options.template}.py").read_text(), end="")
    elif options.name is None:
        print("\n".join(_line(estimator) for estimator in ESTIMATORS.values()))
        print(f"--like: {', '.join(published_names())}")
    elif options.name in published_names():
        print(published_text(options.name), end="")
    else:
        estimator = chosen(options.name)
        weighting, falloff = estimator.integrand
        limit = (
            "estimates, up to strength, rays' occlusion" if estimator.converges else "tends to no rays' occlusion; near"
        )
        rays = f"    {limit}: weighting {weighting}, falloff {falloff}"
        print("\n".join([_line(estimator).splitlines()[0], f"    {estimator.formula}", rays, *_meanings(estimator)]))
        if estimator.text:
            print("\n".join(f"    {fact}" for fact in _found(Path(options.name), estimator)))


def chosen(name: str) -> Estimator:
    """Return the estimator of a name, or of a Python file, which is run; InputError with the line of a mistake."""
    if not name.endswith(".py"):
        return find_estimator(name)
    from lfssao.ao.estimators.own import read_estimator  # its trial needs a camera, and few have a file of their own

    return read_estimator(name)


def _found(path: Path, estimator: Estimator) -> Iterator[str]:
    """Yield facts of an estimator of one's own: the words of views that it reads, and its intervals on a few texels."""
    from lfssao.ao.estimators.own import few_texels, mistakes_in
    from lfssao.ao.formulas import Seen, words_of
    from lfssao.verify.bounds.points import point_bounds

    buffers = few_texels()
    samples = estimator.default_samples()
    if estimator.formulas is None:
        yield "no formulas: no intervals, and its errors are searched by running it"
        return
    numbers = estimator.formulas(buffers, 1.0, *samples, estimator.options())
    words = [word for word in vars(Seen) if word in words_of(numbers) and not word.startswith("_")]
    yield f"reads of a view: {', '.join(words)}"
    with mistakes_in(path):
        bounds = point_bounds(estimator.name, buffers, 1.0, *samples, estimator.parameters)
    if bounds is not None:
        width = float((bounds.upper - bounds.lower).max())
        yield f"its intervals on {bounds.upper.size} texels of two walls: at most {width:.2g} wide (model shader)"


def _meanings(estimator: Estimator) -> Iterator[str]:
    """Yield a line on each parameter: default, meaning, values."""
    for name, meaning in estimator.said("meaning").items():
        taken = ", ".join(estimator.said("choices").get(name, ()))
        if limits := estimator.said("limits").get(name):
            taken = "{:.16g} to {:.16g}".format(*limits)
        power = estimator.said("power").get(name)
        unit = f"; {name} R{'' if power == 1 else f'^{power}'} with --units world" if power else ""
        yield f"    {name}={estimator.parameters[name]}: {meaning}{taken and f' ({taken})'}{unit}"


def _line(estimator: Estimator) -> str:
    many = f"{estimator.count} sample{'s' * (estimator.count != 1)}"
    facts = [many] if estimator.samples is not None else []
    facts += ["normals"] if estimator.normals else []
    facts += ["has bent normals"] if estimator.bent else []
    for name, default in estimator.parameters.items():
        choices = estimator.said("choices").get(name, ())
        note = "|".join(choices) + ", " if choices else ""
        facts.append(f"{name}={default} ({note}default)" if note else f"{name}={default}")
    return f"{estimator.name}: {estimator.title} ({estimator.source})\n    {'; '.join(facts)}"


def take_published(options: argparse.Namespace) -> dict[str, Value]:
    """Set what ``--like`` says of options that are not given; return its parameters (InputError)."""
    if options.like is None:
        options.estimator = options.estimator or "lf"
        return {}
    shader = find_published(options.like)
    if options.estimator not in (None, shader.estimator):
        raise InputError(f"--estimator: {options.estimator}, and --like {options.like} is {shader.estimator}")
    own_rotation = options.rotate in (None, shader.rotate)
    options.estimator = shader.estimator
    options.rotate = options.rotate or shader.rotate
    if options.samples is None and shader.samples is not None:
        try:
            options.samples = values.samples(str(shader.samples))
        except argparse.ArgumentTypeError as error:
            raise InputError(f"{options.like}: samples: {error}") from None
    parameters = shader.parameters_in(options.units)
    if not own_rotation and parameters.get("angle_sum") == "float32":
        return {**parameters, "angle_sum": "exact"}  # float32 is of its own rotation alone
    return parameters


def read_parameters(
    estimator: Estimator, given: list[tuple[str, str]] | None, others: dict[str, Value]
) -> dict[str, Value]:
    """The checked values of ``--parameter NAME=VALUE``, of ``others``, and the estimator's defaults (InputError)."""
    read: dict[str, Value] = {}
    for name, text in given or ():
        if name in read:
            raise InputError(f"--parameter: {name} is given twice")
        try:
            read[name] = values.typed(text, type(estimator.parameters.get(name, "")))
        except argparse.ArgumentTypeError as error:
            raise InputError(f"--parameter {name}: {error}") from None
    with errors_of("--parameter"):
        return full_parameters(estimator, {**others, **read})


def read_rotation(options: argparse.Namespace, sizes: Collection[Size]) -> str | NDArray[Any] | None:
    """The rotation that ``--rotate`` and ``--rotate-rows`` ask for; InputError for a file without angles or vectors."""
    name: str | None = options.rotate
    rows = options.rotate_rows
    if name is not None and name.lower().endswith(ENDINGS):
        from lfssao.samples.noise_file import read_noise  # late: most rotations have a name

        with errors_of("--rotate"):
            return read_noise(Path(name), rows == "below", sizes)
    if rows is not None:
        raise InputError(f"--rotate-rows is for a file ({', '.join(ENDINGS)}) that --rotate gives")
    return name


def _samples_of(estimator: Estimator, path: Path) -> tuple[FloatArray, FloatArray | None]:
    """Points and weights of a file, as they are; InputError if the estimator takes no such points, or no weights."""
    from lfssao.samples.formats import read_points  # late: most samples are made and not read

    with errors_of("--samples"):
        points, weights, domain = read_points(path)
        fitting = {2: ("disk",), 3: ("ball", "sphere")}[estimator.dimensions]
        if points.shape[1] != estimator.dimensions or domain not in (None, *fitting):
            found = f"points of the {domain}" if domain else f"points of {points.shape[1]} numbers"
            raise InputError(f"{path}: it has {found}, estimator {estimator.name} takes points of the {fitting[0]}")
        if weights is not None and estimator.default_samples()[1] is None:
            raise InputError(f"{path}: it has weights, which estimator {estimator.name} does not read")
        if len(points) > values.MOST_SAMPLES:
            raise InputError(f"{path}: it has {len(points)} points, at most {values.MOST_SAMPLES} are taken")
        check_samples(estimator, points, weights)
    return points, weights


def read_samples(
    estimator: Estimator, method: str | None, count: int | Path | None, seed: int | None
) -> tuple[dict[str, Any], FloatArray | None, FloatArray | None]:
    """The samples that ``--sampling``, ``--samples`` and ``--seed`` ask for: manifest's entry, points and weights.

    The entry has the method, 'own' for a set that is the estimator's, 'file' for one of a file. Raises InputError if
    the method is unknown, the file holds no such samples, or the estimator takes no samples, or none in the ball.
    """
    if isinstance(count, Path) and estimator.dimensions:
        if method is not None or seed is not None:
            raise InputError(f"--samples: {count} has the samples, and a --sampling or a --seed would make others")
        given, weights = _samples_of(estimator, count)
        return {"method": "file", "count": len(given), "seed": 0}, given, weights
    try:
        return drawn_samples(estimator, method, count, seed)
    except InputError as error:  # of words that are options here
        words, _, rest = str(error).partition(": ")
        raise InputError(f"{', '.join(f'--{word}' for word in words.split(', '))}: {rest}") from None
