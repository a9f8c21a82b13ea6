"""Pages of Markdown whose commands and Python are run as they stand, and compared with what they show."""

import re
import shlex
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from jobs import python

from lfssao.cli.main import main

# A block that is run, a file that a caption names, or lines of what the block before printed.
BLOCK = re.compile(
    r"^```(?:\{code-block\} )?(sh|python|text)\n(?::caption: (\S+)\n\n)?(.*?)^```", re.MULTILINE | re.DOTALL
)
LFSSAO = re.compile(r"(?:.*&& \.venv/bin/)?lfssao (.*)")


def blocks(text):
    """Language, name of a file or '', and body of each block of a page."""
    return BLOCK.findall(text)


def run_page(text):
    """Run a page in the working folder; the names that its Python leaves, and all that was printed."""
    names = {}
    printed = [""]
    for language, file, body in blocks(text):
        if file:
            Path(file).write_text(body, encoding="utf-8")
        elif language == "text":
            assert [line for line in body.splitlines() if line not in printed[-1]] == [], printed[-1]
        else:
            with redirect_stdout(StringIO()) as said:
                if language == "python":
                    exec(compile(body, "page", "exec"), names)
                else:
                    for line in body.splitlines():
                        run_line(line)
            printed.append(said.getvalue())
    return names, "".join(printed)


def run_line(line):
    """Run a line of a shell: lfssao or pytest. A comment says another exit code than 0."""
    line, _, comment = line.partition("#")
    line, _, target = line.partition(">")
    code = int(re.search(r"exit code (\d): ", f"{comment} exit code 0: ")[1])
    if line.startswith("pytest "):
        print(python("-m", "pytest", "-p", "no:cacheprovider", *shlex.split(line)[1:], code=code).stdout)
    elif target:
        with Path(target.strip()).open("w", encoding="utf-8") as file, redirect_stdout(file):
            assert main(words_of(line)) == code, line
    else:
        assert main(words_of(line)) == code, line


def words_of(line):
    found = LFSSAO.fullmatch(line.strip())
    assert found, f"no test runs '{line}'"
    return shlex.split(found[1])
