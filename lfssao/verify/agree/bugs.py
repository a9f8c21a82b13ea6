"""The bug of a set of views by its name: what explains wrong textures of another renderer, in which of its views.

Causes are those of ``lfssao.compare``: each texture is judged on the renderer's own textures before it, and explained
by a change of the reference that predicts it. Textures, matrices and places of all other views are among these changes.
A cause of one view alone is told apart from one that all views share, and one that goes both ways is an exchange.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from lfssao.verify.agree.views import Renderer, Seen
from lfssao.verify.compare.causes import Cause, causes_of
from lfssao.verify.compare.layers import is_occlusion, stage_order
from lfssao.verify.compare.result import Result
from lfssao.verify.diagnosis.change import ALIKE
from lfssao.verify.verdict import Verdict

_FEW = 3  # views that are named
# Kinds of changes that name another view, and that view; what may be said of its place.
_OF_VIEW = re.compile("(the (?:occlusion|depth|normals|mapping)) of (.*)")
_ORDER = re.compile(r" \([a-z]+s in reverse order\)")


@dataclass(frozen=True)
class Bug:
    """A cause of wrong textures."""

    name: str  # the change of the reference, such as 'the depth of left'
    views: tuple[str, ...]  # that it explains
    words: str  # a sentence


@dataclass(frozen=True)
class Found:
    """Bugs of a set of views."""

    views: tuple[str, ...]  # all
    bugs: tuple[Bug, ...]
    wrong: tuple[str, ...]  # views with a wrong texture
    unexplained: tuple[str, ...]  # of which no bug explains one

    def lines(self) -> list[str]:
        """The bugs in sentences, and which views have none."""
        if not self.wrong:
            return ["mine conforms to the reference in all views: no bug is named"]
        lines = [f"bug of {self._where(bug.views)}: {bug.words}" for bug in self.bugs]
        if self.unexplained:
            lines.append(f"mine is wrong in {_named(self.unexplained)}, and no change that was tried explains it")
        return lines

    def _where(self, views: Sequence[str]) -> str:
        if set(views) == set(self.views):
            return "all views"
        right = [name for name in self.views if name not in self.wrong]
        return f"{_named(views)} alone, not of {_named(right)}" if right else _named(views)


def find_bugs(renderer: Renderer, views: Sequence[Seen], mesh: str | None = None) -> Found:
    """The bugs of another renderer's textures of views, of the layer that these have and of those before it."""
    names = _names(views)
    views, results = sorted(views, key=lambda seen: (seen.key, names[seen])), list[Result]()
    for folder in dict.fromkeys(seen.folder for seen in views):
        own = [seen for seen in views if seen.folder is folder]
        more = {names[seen]: (seen.folder.reference, seen.name) for seen in views if seen.folder is not folder}
        comparison = renderer.comparison(folder, _layers(own[0]), mesh, more)
        for seen in own:
            comparison.add(seen.name)
        told = {seen.name: names[seen] for seen in own}
        results += [replace(each, module=told[each.module]) for each in comparison.report().results]
    order = [names[seen] for seen in views]
    results.sort(key=lambda result: order.index(result.module))
    wrong = [_without_order(result) for result in results if _is_wrong(result)]
    left = [each.module for each in wrong if each.diagnosis is None or not each.diagnosis.fits]
    bugs = _exchanges([Bug(each.kind, each.modules, _words(each)) for each in causes_of(wrong)])
    return Found(tuple(order), bugs, _once(each.module for each in wrong), _once(left))


def _is_wrong(result: Result) -> bool:
    """Whether a texture is outside its interval, or, where none is known, off by more than another order of sums."""
    if result.verdict is Verdict.DIFFERENT and result.metrics is not None:
        figures = result.metrics
        return figures.max_error > ALIKE or figures.nan_mismatches + figures.infinity_mismatches > 0
    return result.verdict is Verdict.OUTSIDE


def _without_order(result: Result) -> Result:
    """The result with other views' names alone, by which views that share a cause are told together."""
    found = result.diagnosis
    if found is None:
        return result
    candidates = [
        replace(each, kind=_ORDER.sub("", each.kind), words=_ORDER.sub("", each.words)) for each in found.candidates
    ]
    return replace(result, diagnosis=replace(found, candidates=tuple(candidates)))


def _words(cause: Cause) -> str:
    """The words of a cause, with views in the place of modules."""
    return cause.words.replace(f" of {len(cause.modules)} modules", f" of {_named(cause.modules)}")


def _exchanges(bugs: Sequence[Bug]) -> tuple[Bug, ...]:
    """The bugs, those together as one that give each of some views what is another's of them."""
    sources: dict[str, dict[str, Bug]] = defaultdict(dict)  # of each kind by the view that something is taken of
    for bug in bugs:
        found = _OF_VIEW.fullmatch(bug.name)
        if found is not None and len(bug.views) == 1:
            sources[found[1]][found[2]] = bug
    made = list(bugs)
    for kind, of in sources.items():
        views = [bug.views[0] for bug in of.values()]
        if len(of) > 1 and set(of) == set(views):
            name = f"{kind} of {_named(sorted(views))} is exchanged"
            some = [bug.words for bug in of.values()]
            words = f"{name}: {'; '.join(some[:_FEW] + ['...'] * (len(some) > _FEW))}"
            made = [bug for bug in made if bug not in of.values()] + [Bug(name, tuple(views), words)]
    return tuple(made)


def _layers(seen: Seen) -> list[str]:
    """Names of the layer that views are compared by, and of all before it that it is made of."""
    last = stage_order(seen.folder.layer)
    before = [each.name for each in seen.layers if stage_order(each.name) <= last]
    return [name for name in before if name in ("depth", "positions", "normals") or is_occlusion(name)]


def _names(views: Sequence[Seen]) -> dict[Seen, str]:
    """Names of views, with their folders' where two have one."""
    often = Counter(seen.name for seen in views)
    return {seen: seen.name if often[seen.name] == 1 else f"{seen.name} of {seen.folder.path}" for seen in views}


def _once(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


def _named(names: Sequence[str]) -> str:
    """A few names, or how many there are."""
    if len(names) > _FEW:
        return f"{len(names)} views"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
