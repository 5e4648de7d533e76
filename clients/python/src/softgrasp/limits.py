"""Upper limits on everything that comes from the other side."""

from __future__ import annotations

from dataclasses import dataclass

PART_LEN_MAX = 65_536
"""Bytes of the small fields of a message; belongs to the format."""


@dataclass(frozen=True)
class Limits:
    """What one side reads at most; the server tells its own in its `Welcome`.

    Units: bytes for `…_len_max`, entries for `…_count_max`. Every announced count is compared with
    these and with the bytes that are there before memory is taken.
    """

    payload_len_max: int = 268_435_456
    """Bytes of a payload."""
    node_count_max: int = 400_000
    """Vertices of a mesh, nodes that are asked for and answered."""
    tet_count_max: int = 2_400_000
    """Tetrahedra of a mesh."""
    dof_count_max: int = 1_200_000
    """Entries of a list of degrees of freedom: known, forces, fixed, reactions, masks."""
    material_count_max: int = 65_536
    """Materials."""
    text_len_max: int = 16_384
    """Bytes of a text."""
