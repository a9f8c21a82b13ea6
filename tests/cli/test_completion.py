"""Completion by the Tab key: the script in a real bash, and what is said where it cannot be made."""

import subprocess
import sys

import pytest
from jobs import sentence

from lfssao.cli.main import COMMANDS, SHELLS, main


def script_of(shell, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--print-completion", shell])
    assert ended.value.code == 0
    return capsys.readouterr().out


def completed(script, *words):
    """The words that bash offers for the last of some."""
    ask = (
        f"COMP_WORDS=({' '.join(map(repr, words))}); COMP_CWORD={len(words) - 1}; _shtab_lfssao\n"
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "-c", f"{script}\n{ask}"], capture_output=True, text=True, check=True, timeout=60)
    return {word.strip() for word in done.stdout.splitlines()}


def test_bash_completes_commands_their_commands_and_options(capsys, tmp_path):
    script = script_of("bash", capsys)
    assert completed(script, "lfssao", "") >= COMMANDS.keys()
    assert completed(script, "lfssao", "re") == {"render"}
    assert completed(script, "lfssao", "samples", "ma") == {"make"}
    assert completed(script, "lfssao", "render", "--ra") == {"--radii"}
    assert completed(script, "lfssao", "compare", "--fail-") == {"--fail-percent"}
    (tmp_path / "page.html").touch()
    assert completed(script, "lfssao", "compare", "--html", f"{tmp_path}/pa") == {f"{tmp_path}/page.html"}


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_has_a_script_with_the_options_of_all_commands(shell, capsys):
    script = script_of(shell, capsys)
    assert "estimator" in script
    assert "fail-percent" in script


def test_a_shell_that_is_none_is_refused(capsys):
    assert main(["--print-completion", "ksh"]) == 2
    assert "invalid choice: 'ksh'" in sentence(capsys)


def test_without_shtab_the_package_is_named(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main(["--print-completion", "bash"]) == 2
    assert sentence(capsys) == "--print-completion needs shtab: pip install 'lfssao[completion]'"
