"""The steps of `.ci/run`, with stand-ins for the programs that change the machine, for the tests and for the pages."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

RUN = Path(__file__).parents[2] / ".ci" / "run"
TEST_COMMAND = "<!-- test -->\n```\necho tested ${DEBIAN_FRONTEND:-interactive} CI=$CI\n```\n<!-- end -->\n"
DOCS_COMMAND = "<!-- docs -->\n```sh\necho documented\n```\n<!-- end -->\n"
PACKAGES = "libegl1 libgl1 libgl1-mesa-dri chromium chromium-driver"
ASKED = ["update -q", f"install -q -y --no-install-recommends {PACKAGES}"]


def installed(*states):
    """A dpkg-query that knows one state of each package, and as the real one fails where it knows fewer."""
    printed = "".join(f"{state} " for state in states)
    return f'[ "$*" = "-W -f \\${{db:Status-Status}}  {PACKAGES}" ] && printf "{printed}"; exit {len(states) != 5:d}'


def ci(folder, query, apt, user, docs=DOCS_COMMAND, code=0):
    """Run it on texts of its own; what the tests' and the pages' commands print, and the arguments of each apt-get."""
    (folder / ".ci").mkdir()
    shutil.copy(RUN, folder / ".ci" / "run")
    (folder / "README.md").write_text(TEST_COMMAND)
    (folder / "CONTRIBUTING.md").write_text(docs)
    (folder / "programs").mkdir()
    asked = folder / "asked"
    for name, does in (("id", f"echo {user}"), ("dpkg-query", query), ("apt-get", f'echo "$@" >> {asked}; {apt}')):
        program = folder / "programs" / name
        program.write_text(f"#!/bin/sh\n{does}\n")
        program.chmod(0o755)
    env = {**os.environ, "PATH": f"{folder / 'programs'}{os.pathsep}{os.environ['PATH']}"}
    for name in ("DEBIAN_FRONTEND", "CI"):
        env.pop(name, None)
    done = subprocess.run([folder / ".ci" / "run"], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    printed = [line for line in done.stdout.splitlines() if not line.startswith("+ ")]
    said, _, under_ci = printed[0].rpartition(" CI=")
    assert under_ci == "true"  # else tests of shaders skip where there is no driver
    return [said, *printed[1:]], asked.read_text().splitlines() if asked.exists() else []


@pytest.mark.parametrize(("states", "apt", "user", "said", "asked"), [
    ([], "exit 0", 0, "noninteractive", ASKED),
    (["installed"] * 4, "exit 0", 0, "noninteractive", ASKED),
    ([*["installed"] * 4, "config-files"], "exit 0", 0, "noninteractive", ASKED),
    (["installed"] * 5, "exit 0", 0, "interactive", []),
    ([], "exit 0", 1000, "interactive", []),  # who may not install does not try
    # Without a network the lists or the packages cannot be had; the tests then say what is missing.
    ([], "exit 100", 0, "noninteractive", ASKED),
    ([], '[ "$1" = install ]', 0, "noninteractive", ASKED),
])  # fmt: skip
def test_drivers_that_are_missing_are_installed_by_who_may(tmp_path, states, apt, user, said, asked):
    assert ci(tmp_path, installed(*states), apt, user) == ([f"tested {said}", "documented"], asked)


@pytest.mark.parametrize("docs", ["", DOCS_COMMAND.replace("echo documented", "false")], ids=["no command", "fails"])
def test_pages_that_are_not_made_fail_it(tmp_path, docs):
    said, _ = ci(tmp_path, installed(*["installed"] * 5), "exit 0", 0, docs, code=1)
    assert said == ["tested interactive"]
