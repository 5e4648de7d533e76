"""The server program: finding it, starting it on a free port of this machine, ending it."""

from __future__ import annotations

import atexit
import contextlib
import os
import queue
import shutil
import subprocess
import sysconfig
import tempfile
import threading
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from .errors import ServerNotStarted

NAME = "fea-server"
"""Name of the program."""
_SAYS = "listening on "
_END_MAX = 5.0
"""Seconds after which a server that was asked to end is killed; it promises three."""
_STORY_LEN = 2_000
_WITH_INPUT = "--end-with-input"
"""Option by which a server ends when its standard input does."""


class ServerProgram:
    """A server that this process started, on the loopback of this machine.

    It ends with `end`, and at the latest when Python does, also where that is killed (by servers of
    versions that have the option --end-with-input).
    """

    def __init__(
        self,
        program: str | os.PathLike[str] | None = None,
        arguments: Sequence[str] = (),
        wait: float = 30.0,
        *,
        threads: int | None = None,
    ) -> None:
        """Starts the program and waits until it listens, at most `wait` seconds.

        `program` is a path; without one the PATH is searched for `fea-server`, then the folder of
        this Python's scripts. `arguments` stand
        behind `--listen 127.0.0.1:0`, and behind `--threads` where `threads` says how many. Raises
        `ServerNotStarted` with what the program said.
        """
        path = find_program(program)
        self._log = tempfile.TemporaryFile()
        environment = {"RUST_LOG": "warn", **os.environ}
        options = [] if threads is None else ["--threads", str(threads)]
        if _knows(path, _WITH_INPUT):
            options.append(_WITH_INPUT)
        command = [path, "--listen", "127.0.0.1:0", *options, *arguments]
        try:
            self._process = subprocess.Popen(
                command,
                # Held open by this process alone, and closed with it.
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                env=environment,
            )
        except OSError as error:
            self._log.close()
            raise ServerNotStarted(f"{path} cannot be started: {error}") from error
        atexit.register(self.end)
        try:
            self.address = self._first_words(path, wait)
        except BaseException:
            self.end()
            raise

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def kill(self) -> None:
        """Ends it at once, as a crash would."""
        self._process.kill()
        self._process.wait()

    def end(self) -> None:
        """Asks it to end, and kills it where it does not; may be called again."""
        atexit.unregister(self.end)
        if self.is_running:
            self._process.terminate()
            try:
                self._process.wait(_END_MAX)
            except subprocess.TimeoutExpired:
                self.kill()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
        self._log.close()

    def _first_words(self, path: str, wait: float) -> str:
        """The address in the first line that the program prints."""
        lines: queue.Queue[bytes] = queue.Queue()
        stream = self._process.stdout
        assert stream is not None
        reader = threading.Thread(target=lambda: lines.put(stream.readline(1_000)), daemon=True)
        reader.start()
        try:
            line = lines.get(timeout=wait).decode(errors="replace").strip()
        except queue.Empty:
            self._process.kill()
            raise ServerNotStarted(f"{path} does not listen after {wait} s") from None
        if not line.startswith(_SAYS):
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(1.0)
            raise ServerNotStarted(f"{path} does not listen: {line} {self._story()}".rstrip())
        return line.removeprefix(_SAYS)

    def _story(self) -> str:
        self._log.seek(0, os.SEEK_END)
        self._log.seek(max(0, self._log.tell() - _STORY_LEN))
        return self._log.read().decode(errors="replace").strip()


@lru_cache
def _knows(path: str, option: str) -> bool:
    """Whether the program has an option; an older one would refuse to start with it."""
    try:
        told = subprocess.run([path, "--help"], capture_output=True, timeout=10.0, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return option.encode() in told.stdout


def find_program(program: str | os.PathLike[str] | None) -> str:
    """The path of the server program. Raises `ServerNotStarted` where there is none."""
    if program is not None:
        if not Path(program).is_file():
            raise ServerNotStarted(f"there is no program {os.fspath(program)}")
        return os.fspath(program)
    # Beside the scripts of this Python, where the package softgrasp-bin lays it: an environment that is
    # not activated is not on the PATH.
    found = shutil.which(NAME) or shutil.which(NAME, path=sysconfig.get_path("scripts"))
    if found is None:
        raise ServerNotStarted(
            f"there is no {NAME} on the PATH: name it, as in Server.spawn('target/release/{NAME}')"
        )
    return found
