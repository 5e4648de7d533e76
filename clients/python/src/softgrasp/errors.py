"""What can go wrong: refusals by their number, lost connections, bytes that are no answer."""

from __future__ import annotations


class SoftgraspError(Exception):
    """Any error of this package but wrong arguments, which are `ValueError`."""


class MeshFileError(SoftgraspError, ValueError):
    """A mesh file cannot be read; the text names the file, the place and what was expected."""


class ServerNotStarted(SoftgraspError):
    """No server program was found, or it ended before it listened."""


class NotCapable(SoftgraspError):
    """The server is an older one and lacks what a request needs; nothing was sent."""


class BadStream(SoftgraspError):
    """The other side sent bytes that are no message of this protocol; the connection is closed."""


class ConnectionLost(SoftgraspError, ConnectionError):
    """The connection broke or is closed; nothing is known of a request that was under way.

    Every request may be asked again on a new connection (`Server.reconnect`). Models stay with a
    server that lives on; a large deformation begins at rest again.
    """


class NoAnswerInTime(ConnectionLost, TimeoutError):
    """The time that the caller was willing to wait is over; the connection is closed."""


class Refused(SoftgraspError):
    """The server refused a request; the session goes on unless the code says otherwise.

    `code` is the number on the wire, `text` a sentence for the user, `detail` more for a log.
    `retry_after` says in how many seconds to ask again; None where the server does not know, or
    where it is of no use.
    """

    code: int = 0

    def __init__(
        self, code: int, text: str, detail: str = "", retry_after: float | None = None
    ) -> None:
        super().__init__(f"{type(self).__name__} ({code}): {text}")
        self.code = code
        self.text = text
        self.detail = detail
        self.retry_after = retry_after

    def __reduce__(self) -> tuple[type[Refused], tuple[int, str, str, float | None]]:
        return type(self), (self.code, self.text, self.detail, self.retry_after)


class BadRequest(Refused):
    """1: the message does not decode, or its content makes no sense."""

    code = 1


class UnknownModel(Refused):
    """2: no model has this hash there; upload it (a `KeptModel` does that by itself)."""

    code = 2


class RigidMotionFree(Refused):
    """3: the prescribed displacements leave a body free to move rigidly."""

    code = 3


class TooLarge(Refused):
    """4: a count or a payload is over a limit of the server."""

    code = 4


class Busy(Refused):
    """5: all sessions of the server are taken; try again later."""

    code = 5


class NotAuthorised(Refused):
    """6: the token is missing or wrong."""

    code = 6


class UnknownMethod(Refused):
    """7: no method has this name."""

    code = 7


class NotPositiveDefinite(Refused):
    """8: the stiffness of the free degrees of freedom is not positive definite."""

    code = 8


class MemoryLimit(Refused):
    """9: the work would need more memory than the server may use."""

    code = 9


class DeadlineMissed(Refused):
    """10: the answer could not be had in time."""

    code = 10


class ShuttingDown(Refused):
    """11: the server is about to end."""

    code = 11


class InternalFault(Refused):
    """12: the server is at fault."""

    code = 12


class UnsupportedVersion(Refused):
    """13: server and package speak no common version of the wire; the text names both."""

    code = 13


class Uncertain(Refused):
    """14: no digit would be certain; with large deformation also: no equilibrium was found."""

    code = 14


class Cancelled(Refused):
    """15: this client has cancelled the request (`Server.cancel`)."""

    code = 15


class Superseded(Refused):
    """16: a newer frame with `newest_wins` came before this one was begun."""

    code = 16


class ClusterLost(Refused):
    """17: the cluster behind the server was lost; ask again after `retry_after`."""

    code = 17


REFUSALS: dict[int, type[Refused]] = {refusal.code: refusal for refusal in Refused.__subclasses__()}
"""The exception of every reject code."""


def refusal_of(code: int, text: str, detail: str = "", retry_after: float | None = None) -> Refused:
    """The exception of a reject code; `Refused` itself for a number that is not known."""
    return REFUSALS.get(code, Refused)(code, text, detail, retry_after)
