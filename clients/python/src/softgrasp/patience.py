"""How long a server is waited for."""

from __future__ import annotations

from dataclasses import dataclass

ALIVE_MISSED = 3
"""A server that says that it is there is given up after so many times of its silence."""


@dataclass(frozen=True)
class Patience:
    """How long a server is waited for; seconds, None for ever."""

    answer: float | None
    """For the reply to a request, since it was sent and since the reply to the one before it."""
    alive_every: float | None
    """The server says that it is there when it has said nothing for so long."""

    @property
    def silence(self) -> float | None:
        """Silence after which the server is given up."""
        return None if self.alive_every is None else ALIVE_MISSED * self.alive_every

    @property
    def has_end(self) -> bool:
        """Whether the clock is to be looked at."""
        return self.answer is not None or self.alive_every is not None
