"""Name the bugs of another renderer: changes of the reference that explain wrong textures, with the affected views.

Causes are those of ``lfssao.compare``: each texture is judged against the renderer's own earlier textures, and
explained by a change of the reference that predicts it. Such a change may use textures, matrices and places of all
other views. A report distinguishes causes of single views from causes of all views, and merges mutual exchanges.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from lfssao.verify.agree.views import RenderedView, Renderer
from lfssao.verify.compare.causes import Cause, causes_of
from lfssao.verify.compare.layers import is_occlusion, stage_order
from lfssao.verify.compare.result import Result
from lfssao.verify.diagnosis.change import SUM_TOLERANCE
from lfssao.verify.verdict import Verdict

_FEW = 3  # views that are named
# Kinds of changes that name another view, and that view; a remark on its place.
_OF_VIEW = re.compile("(the (?:occlusion|depth|normals|mapping)) of (.*)")
_ORDER = re.compile(r" \([a-z]+s in reverse order\)")


@dataclass(frozen=True)
class Bug:
    """A cause of wrong textures."""

    name: str  # the change of the reference, such as 'the depth of left'
    views: tuple[str, ...]  # the explained views
    words: str  # a sentence


@dataclass(frozen=True)
class Found:
    """Bugs of a set of views."""

    views: tuple[str, ...]  # all
    bugs: tuple[Bug, ...]
    wrong: tuple[str, ...]  # views with a wrong texture
    unexplained: tuple[str, ...]  # views with a wrong texture that no bug explains

    def lines(self) -> list[str]:
        """The bugs and the unexplained views, in sentences."""
        if not self.wrong:
            return ["mine conforms to the reference in all views: no bug is named"]
        lines = [f"bug of {self._view_names(bug.views)}: {bug.words}" for bug in self.bugs]
        if self.unexplained:
            lines.append(f"mine is wrong in {_listed(self.unexplained)}, and no change that was tried explains it")
        return lines

    def _view_names(self, views: Sequence[str]) -> str:
        if set(views) == set(self.views):
            return "all views"
        right = [name for name in self.views if name not in self.wrong]
        return f"{_listed(views)} alone, not of {_listed(right)}" if right else _listed(views)


def find_bugs(renderer: Renderer, views: Sequence[RenderedView], mesh: str | None = None) -> Found:
    """The bugs of another renderer's textures of views, in the views' layer and the layers before it."""
    names = _names(views)
    views = sorted(views, key=lambda view: (view.key, names[view]))
    results = list[Result]()
    for folder in dict.fromkeys(view.folder for view in views):
        views_of_folder = [view for view in views if view.folder is folder]
        other_views = {names[view]: (view.folder.reference, view.name) for view in views if view.folder is not folder}
        comparison = renderer.comparison(folder, _layers(views_of_folder[0]), mesh, other_views)
        for view in views_of_folder:
            comparison.add(view.name)
        labels = {view.name: names[view] for view in views_of_folder}
        results += [replace(result, module=labels[result.module]) for result in comparison.report().results]
    order = [names[view] for view in views]
    results.sort(key=lambda result: order.index(result.module))
    wrong = [_without_order(result) for result in results if _is_wrong(result)]
    unexplained = [result.module for result in wrong if result.diagnosis is None or not result.diagnosis.fits]
    bugs = _merged_exchanges([Bug(result.kind, result.modules, _words(result)) for result in causes_of(wrong)])
    return Found(tuple(order), bugs, _distinct(result.module for result in wrong), _distinct(unexplained))


def _is_wrong(result: Result) -> bool:
    """Whether a texture is outside its interval, or without one differs by more than another order of sums."""
    if result.verdict is Verdict.DIFFERENT and result.metrics is not None:
        figures = result.metrics
        return figures.max_error > SUM_TOLERANCE or figures.nan_mismatches + figures.infinity_mismatches > 0
    return result.verdict is Verdict.OUTSIDE


def _without_order(result: Result) -> Result:
    """The result with bare names of other views, so that views with the same cause are merged."""
    diagnosis = result.diagnosis
    if diagnosis is None:
        return result
    candidates = [
        replace(candidate, kind=_ORDER.sub("", candidate.kind), words=_ORDER.sub("", candidate.words))
        for candidate in diagnosis.candidates
    ]
    return replace(result, diagnosis=replace(diagnosis, candidates=tuple(candidates)))


def _words(cause: Cause) -> str:
    """The words of a cause, with views in place of modules."""
    return cause.words.replace(f" of {len(cause.modules)} modules", f" of {_listed(cause.modules)}")


def _merged_exchanges(bugs: Sequence[Bug]) -> tuple[Bug, ...]:
    """The bugs; bugs that exchange something among views become one."""
    sources: dict[str, dict[str, Bug]] = defaultdict(dict)  # of each kind by the view that something is taken of
    for bug in bugs:
        match = _OF_VIEW.fullmatch(bug.name)
        if match is not None and len(bug.views) == 1:
            sources[match[1]][match[2]] = bug
    merged = list(bugs)
    for kind, bugs_by_source in sources.items():
        views = [bug.views[0] for bug in bugs_by_source.values()]
        if len(bugs_by_source) > 1 and set(bugs_by_source) == set(views):
            name = f"{kind} of {_listed(sorted(views))} is exchanged"
            sentences = [bug.words for bug in bugs_by_source.values()]
            words = f"{name}: {'; '.join(sentences[:_FEW] + ['...'] * (len(sentences) > _FEW))}"
            merged = [bug for bug in merged if bug not in bugs_by_source.values()] + [Bug(name, tuple(views), words)]
    return tuple(merged)


def _layers(view: RenderedView) -> list[str]:
    """Names of the compared layer and of all layers that it is computed from."""
    order = stage_order(view.folder.layer)
    names = [each.name for each in view.layers if stage_order(each.name) <= order]
    return [name for name in names if name in ("depth", "positions", "normals") or is_occlusion(name)]


def _names(views: Sequence[RenderedView]) -> dict[RenderedView, str]:
    """Names of views, with their folders' if two views share a name."""
    counts = Counter(view.name for view in views)
    return {view: view.name if counts[view.name] == 1 else f"{view.name} of {view.folder.path}" for view in views}


def _distinct(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


def _listed(names: Sequence[str]) -> str:
    """A few names, or the number of them."""
    if len(names) > _FEW:
        return f"{len(names)} views"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
