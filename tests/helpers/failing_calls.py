"""System calls that fail: a child runs a function, and the kernel asks this process before each call below a folder."""

import ctypes
import fcntl
import os
import platform
import select
import socket
import struct
from pathlib import Path

# Numbers of calls that change, close or name a file, on x86-64 and on AArch64; then which argument is a path.
_ARM = platform.machine() == "aarch64"
_BY_DESCRIPTOR = {
    "write": (1, 64), "pwrite64": (18, 68), "writev": (20, 66), "lseek": (8, 62), "fsync": (74, 82), "close": (3, 57),
    "ftruncate": (77, 46),
}  # fmt: skip
_BY_PATH = {
    "open": (2, None, 0), "openat": (257, 56, 1), "rename": (82, None, 0), "renameat": (264, 38, 1),
    "mkdir": (83, None, 0), "mkdirat": (258, 34, 1),
}  # fmt: skip
_CALLS = {numbers[_ARM]: (name, None) for name, numbers in _BY_DESCRIPTOR.items()} | {
    row[_ARM]: (name, row[2]) for name, row in _BY_PATH.items() if row[_ARM] is not None
}
_SECCOMP = 277 if _ARM else 317
_RECEIVE, _SEND = 0xC0502100, 0xC0182101  # of linux/seccomp.h
_ALLOW = 0x7FFF0000
_ASK = 0x7FC00000


def _ask_before_calls():
    """From now on such calls of this process wait for an answer; the descriptor to give it by."""
    tests = [(0x15, len(_CALLS) - k, 0, number) for k, number in enumerate(_CALLS)]
    lines = [struct.pack("HBBI", *line) for line in [(0x20, 0, 0, 0), *tests, (6, 0, 0, _ALLOW), (6, 0, 0, _ASK)]]
    code = ctypes.create_string_buffer(b"".join(lines))
    program = struct.pack("HxxxxxxQ", len(lines), ctypes.addressof(code))
    libc = ctypes.CDLL(None, use_errno=True)
    assert libc.prctl(38, 1, 0, 0, 0) == 0
    listener = libc.syscall(_SECCOMP, 1, 8, program)
    assert listener >= 0, os.strerror(ctypes.get_errno())
    return listener


def run_failing(function, folder, error_of):
    """Run ``function`` in a child process; its exit code, and the name of each call on a file below ``folder``.

    ``error_of`` says by the number of such a call, from 0 on, which error it ends in; 0 lets it be.
    """
    here, there = socket.socketpair()
    child = os.fork()
    if child == 0:
        code = 99
        try:
            socket.send_fds(there, [b"x"], [_ask_before_calls()])
            code = function()
        finally:
            os._exit(code)
    _, (listener,), _, _ = socket.recv_fds(here, 1, 1)
    here.close()
    there.close()
    calls = []
    waiting = select.poll()
    waiting.register(listener, select.POLLIN)
    while not waiting.poll()[0][1] & select.POLLHUP:
        asked = bytearray(80)
        fcntl.ioctl(listener, _RECEIVE, asked)
        identity, process, _, number = struct.unpack_from("QIIi", asked)
        name, path = _call(process, number, struct.unpack_from("6Q", asked, 32))
        error = 0
        if path.startswith(str(folder)):
            error = error_of(len(calls))
            calls.append(name)
        fcntl.ioctl(listener, _SEND, struct.pack("QqiI", identity, 0, -error, 0 if error else 1))
    os.close(listener)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), calls


def _call(process, number, arguments):
    """Name of a call, and the path that it is about."""
    name, place = _CALLS[number]
    if place is None:
        link = Path(f"/proc/{process}/fd/{arguments[0]}")
        return name, str(link.readlink()) if link.is_symlink() else ""
    with Path(f"/proc/{process}/mem").open("rb", buffering=0) as memory:
        memory.seek(arguments[place])
        return name, os.fsdecode(memory.read(4096).split(b"\0")[0])
