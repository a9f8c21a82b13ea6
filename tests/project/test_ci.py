"""What `.ci/run` does before the tests, with stand-ins for the programs that change the machine."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

RUN = Path(__file__).parents[2] / ".ci" / "run"
TEST_COMMAND = "<!-- test -->\n```\necho tested ${DEBIAN_FRONTEND:-interactive} CI=$CI\n```\n<!-- end -->\n"
PACKAGES = "libegl1 libgl1 libgl1-mesa-dri"
ASKED = ["update -q", f"install -q -y --no-install-recommends {PACKAGES}"]


def installed(*states):
    """A dpkg-query that knows one state of each package, and as the real one fails where it knows fewer."""
    printed = "".join(f"{state} " for state in states)
    return f'[ "$*" = "-W -f \\${{db:Status-Status}}  {PACKAGES}" ] && printf "{printed}"; exit {len(states) != 3:d}'


def ci(folder, query, apt="exit 0", user=0):
    """Run it on a README of its own; what was printed, and the arguments of each call of apt-get."""
    (folder / ".ci").mkdir()
    shutil.copy(RUN, folder / ".ci" / "run")
    (folder / "README.md").write_text(TEST_COMMAND)
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
    assert done.returncode == 0, done.stderr
    said, _, under_ci = done.stdout.splitlines()[-1].rpartition(" CI=")
    assert under_ci == "true"  # else tests of shaders skip where there is no driver
    return said, asked.read_text().splitlines() if asked.exists() else []


@pytest.mark.parametrize("states", [[], ["installed"] * 2, ["installed", "installed", "config-files"]])
def test_drivers_that_are_missing_are_installed(tmp_path, states):
    assert ci(tmp_path, installed(*states)) == ("tested noninteractive", ASKED)


def test_drivers_that_are_there_are_left_alone(tmp_path):
    assert ci(tmp_path, installed(*["installed"] * 3)) == ("tested interactive", [])


def test_who_may_not_install_does_not_try(tmp_path):
    assert ci(tmp_path, installed(), user=1000) == ("tested interactive", [])


@pytest.mark.parametrize("apt", ["exit 100", '[ "$1" = install ]'])
def test_tests_run_although_apt_fails(tmp_path, apt):
    """Without a network the lists or the packages cannot be had; the tests then say what is missing."""
    assert ci(tmp_path, installed(), apt) == ("tested noninteractive", ASKED)
