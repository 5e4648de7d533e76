"""What a session and a kept model have, whether their answers are waited for or awaited."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from . import calls
from .address import Tls
from .arrays import positive
from .calls import Call, Welcome
from .errors import NotCapable
from .limits import Limits
from .model import Model
from .patience import Patience
from .program import ServerProgram
from .question import FrameOptions, Question

CLIENT = "softgrasp for Python 0.1.0"
"""How this package calls itself in the server's log."""


class Session:
    """Where the server is, how it is spoken to, and what it said of itself."""

    _welcome: Welcome

    def __init__(
        self,
        address: str,
        token: str | None,
        tls: Tls,
        timeout: float | None,
        limits: Limits | None,
        alive_every: float | None,
    ) -> None:
        """Keeps what a connection is made with; connects to nothing."""
        if alive_every is not None:
            alive_every = max(positive(alive_every, "alive_every"), _ALIVE_MIN)
        self.address = address
        self._program: ServerProgram | None = None
        self._token, self._tls = token, tls
        self._patience = Patience(timeout, alive_every)
        self._limits = Limits() if limits is None else limits

    @property
    def welcome(self) -> Welcome:
        """Name, version, threads and limits of the server."""
        return self._welcome

    @property
    def capabilities(self) -> frozenset[str]:
        """What the server can do, by name: `large`, `cases`, `contact`, `cancel`, …"""
        return self._welcome.capabilities

    @property
    def program(self) -> ServerProgram | None:
        """The program of a server that was spawned."""
        return self._program

    def _check(self, call: Call[Any]) -> None:
        """Raises `NotCapable` where the server does not know what a request needs."""
        if call.needs and (missing := call.needs - self._welcome.capabilities):
            welcome = self._welcome
            raise NotCapable(f"{welcome.server} {welcome.version} does not know {min(missing)!r}")

    def _hello(self) -> Call[Welcome]:
        return calls.hello(CLIENT, self._token, self._patience.alive_every)


class NamedModel:
    """A model with its fixed degrees of freedom and the name that a server keeps it by."""

    def __init__(self, model: Model, fixed: ArrayLike) -> None:
        """All three axes of the nodes `fixed` are fixed."""
        self.model = model
        self.fixed_dofs = model.fixed_dofs(fixed)
        self.hash = model.hash(self.fixed_dofs)
        """Name of the model: 32 bytes."""
        self._asked: tuple[FrameOptions, Question] | None = None

    def _question(self, options: FrameOptions) -> Question:
        """What is asked; what the frame before asked, where its options were these very objects.

        Frames that differ in their load case alone ask the same again and again.
        """
        asked = self._asked
        if asked is not None and len(options) == len(asked[0]):
            if all(asked[0].get(name, self) is value for name, value in options.items()):
                return asked[1]
        question = Question(**options)
        # What was copied to be checked would not follow a change of the caller's own.
        follows = question.nodes is options.get("nodes") and not question.fields
        self._asked = (options, question) if follows and question.quantity is None else None
        return question


_ALIVE_MIN = 0.1
"""A server does not say that it is there more often; s."""
