"""Mesh files: Gmsh MSH 1, 2 and 4 in text by an own reader, all other formats by meshio."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import U32, Floats, Numbers
from .errors import MeshFileError

_TETRAHEDRA = {4: 4, 11: 10, 29: 20, 30: 35}
"""Nodes of the element types of Gmsh that are tetrahedra; the first four are the corners."""
_TEN_NODES = 11
"""The type of Gmsh with a node in the middle of each edge; its last two are exchanged here."""
_EXCHANGED = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
_LABEL_MAX = 0xFFFF_FFFF
_BEGINNINGS = (
    (b"$MeshFormat", "gmsh"),
    (b"<VTKFile", "vtu"),
    (b"# vtk DataFile", "vtk"),
    (b"MeshVersionFormatted", "medit"),
)
"""How files of some formats begin, and what meshio calls these."""


class _Lines:
    """The lines of a text file, with their numbers for messages."""

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._lines = text.splitlines()
        self._at = 0

    def fault(self, text: str) -> MeshFileError:
        return MeshFileError(f"{self._path}, line {self._at}: {text}")

    def next(self, what: str) -> str:
        if self._at >= len(self._lines):
            self._at += 1
            raise self.fault(f"expected {what}, and the file ends")
        self._at += 1
        return self._lines[self._at - 1]

    def integers(self, what: str, count: int) -> list[int]:
        """The first whole numbers of a line; there must be so many at least."""
        words = self.next(what).split()
        try:
            found = [int(word) for word in words]
        except ValueError:
            raise self.fault(f"expected {what}, found {' '.join(words)[:40]!r}") from None
        if len(found) < count:
            raise self.fault(f"expected {what}: {count} numbers, found {len(found)}")
        return found

    def table(self, what: str, rows: int, kind: type) -> np.ndarray[Any, Any]:
        """So many lines as the rows of a table."""
        if not 0 <= rows <= len(self._lines) - self._at:
            raise self.fault(f"{rows} {what} are announced and not there")
        words = [line.split() for line in self._lines[self._at : self._at + rows]]
        try:
            table: np.ndarray[Any, Any] = np.array(words, dtype=kind).reshape(rows, -1)
        except (ValueError, OverflowError):
            raise self.fault(f"the {rows} lines from here on are not {what}") from None
        self._at += rows
        return table

    def section(self) -> str | None:
        """The name of the next section, without its `$`; None at the end of the file."""
        while self._at < len(self._lines):
            line = self._lines[self._at].strip()
            self._at += 1
            if line.startswith("$") and not line.startswith("$End"):
                return line[1:]
        return None


class _Raw:
    """What has been read so far: nodes with their labels, tetrahedra with their regions."""

    def __init__(self) -> None:
        self.labels: list[np.ndarray[Any, Any]] = []
        self.points: list[np.ndarray[Any, Any]] = []
        self.tets: list[np.ndarray[Any, Any]] = []
        self.regions: list[np.ndarray[Any, Any]] = []

    def add(self, kind: int, nodes: np.ndarray[Any, Any], region: np.ndarray[Any, Any]) -> None:
        self.tets.append(nodes[:, _EXCHANGED] if kind == _TEN_NODES else nodes[:, :4])
        self.regions.append(region)


MeshArrays = tuple[Floats, "np.ndarray[Any, Any]", "Numbers | None"]
"""Places of nodes; four or ten nodes of each tetrahedron; and regions where there are several."""


def read_mesh(path: Path, scale: float) -> MeshArrays:
    """What a mesh is made of, from a file; see `Mesh.read`."""
    with path.open("rb") as file:
        start = file.read(128)
    start = start.lstrip()
    version, is_binary = 0.0, False
    if start.startswith(b"$MeshFormat"):
        version, is_binary = _format(path, start)
    elif start.startswith(b"$NOD"):
        version = 1.0
    reader = {1: _read_1, 2: _read_2, 4: _read_4}.get(int(version))
    if reader is not None and not is_binary:
        lines = _Lines(path, path.read_text(encoding="utf-8", errors="replace"))
        return _mesh(path, _read(lines, reader, version), scale)
    # The content tells, whatever the file is called; meshio goes by the name otherwise.
    known = [form for beginning, form in _BEGINNINGS if beginning in start]
    return _read_by_meshio(path, scale, known[0] if known else None)


def _format(path: Path, start: bytes) -> tuple[float, bool]:
    words = start.split()
    try:
        version, is_binary = float(words[1]), int(words[2]) != 0
        int(version)
    except (IndexError, ValueError, OverflowError):
        raise MeshFileError(f"{path}, line 2: expected version and type of the file") from None
    return version, is_binary


_Reader = Callable[[_Lines, str, float, dict[int, int], _Raw], None]


def _read(lines: _Lines, reader: _Reader, version: float) -> _Raw:
    raw = _Raw()
    physical: dict[int, int] = {}
    while (section := lines.section()) is not None:
        reader(lines, section, version, physical, raw)
    return raw


def _read_1(
    lines: _Lines, section: str, _version: float, _physical: dict[int, int], raw: _Raw
) -> None:
    if section == "NOD":
        _read_2(lines, "Nodes", 2.0, _physical, raw)
    elif section == "ELM":
        for _ in range(lines.integers("the number of elements", 1)[0]):
            # Number, type, physical and elementary region, number of nodes, nodes.
            row = lines.integers("an element", 5)
            size = _TETRAHEDRA.get(row[1])
            if size is None:
                continue
            if len(row) < 5 + size:
                raise lines.fault(f"an element of type {row[1]} has {size} nodes")
            nodes = np.array([row[5 : 5 + size]], dtype=np.int64)
            raw.add(row[1], nodes, np.array([row[2] or row[3]], dtype=np.int64))


def _read_2(
    lines: _Lines, section: str, _version: float, _physical: dict[int, int], raw: _Raw
) -> None:
    if section == "Nodes":
        table = lines.table("nodes", lines.integers("the number of nodes", 1)[0], float)
        if table.size and table.shape[1] < 4:
            raise lines.fault("a node has a number and three coordinates")
        raw.labels.append(table[:, 0].astype(np.int64))
        raw.points.append(table[:, 1:4])
    elif section == "Elements":
        # Rows of one type and number of tags have one length, and become one table.
        rows: dict[tuple[int, int], list[list[int]]] = {}
        for _ in range(lines.integers("the number of elements", 1)[0]):
            row = lines.integers("an element", 3)
            size = _TETRAHEDRA.get(row[1])
            if size is None:
                continue
            if row[2] < 0 or len(row) < 3 + row[2] + size:
                raise lines.fault(f"an element of type {row[1]} has {size} nodes")
            rows.setdefault((row[1], row[2]), []).append(row[: 3 + row[2] + size])
        for (kind, tags), same in rows.items():
            table = np.array(same, dtype=np.int64)
            region = table[:, 3] if tags else np.zeros(len(table), dtype=np.int64)
            if tags > 1:
                region = np.where(region == 0, table[:, 4], region)
            raw.add(kind, table[:, 3 + tags :], region)


def _read_4(
    lines: _Lines, section: str, version: float, physical: dict[int, int], raw: _Raw
) -> None:
    is_40 = version < 4.1
    if section == "Entities":
        counts = lines.integers("the numbers of entities", 4)
        for _ in range(sum(counts[:3])):
            lines.next("an entity")
        for _ in range(counts[3]):
            words = lines.next("a volume").split()
            # Tag, box of six numbers, number of physical groups, these groups.
            try:
                if len(words) > 8 and int(words[7]) > 0:
                    physical[int(words[0])] = abs(int(words[8]))
            except ValueError:
                raise lines.fault("expected a volume with its physical groups") from None
    elif section == "Nodes":
        for _ in range(lines.integers("the number of node blocks", 2)[0]):
            count = lines.integers("a block of nodes", 4)[3]
            if is_40:
                table = lines.table("nodes", count, float)
                labels, points = table[:, :1], table[:, 1:4]
            else:
                labels = lines.table("numbers of nodes", count, int)
                points = lines.table("nodes", count, float)[:, :3]
            if count and (labels.shape[1] != 1 or points.shape[1] != 3):
                raise lines.fault("a node has a number and three coordinates")
            raw.labels.append(labels.reshape(-1).astype(np.int64))
            raw.points.append(points.reshape(-1, 3))
    elif section == "Elements":
        for _ in range(lines.integers("the number of element blocks", 2)[0]):
            first, second, kind, count = lines.integers("a block of elements", 4)[:4]
            if kind not in _TETRAHEDRA:
                for _ in range(count):
                    lines.next("an element")
                continue
            table = lines.table("elements", count, int)
            if count and table.shape[1] < 1 + _TETRAHEDRA[kind]:
                raise lines.fault(f"an element of type {kind} has {_TETRAHEDRA[kind]} nodes")
            tag = first if is_40 else second
            nodes = table[:, 1:].reshape(count, _TETRAHEDRA[kind])
            raw.add(kind, nodes, np.full(count, physical.get(tag, tag)))


def _mesh(path: Path, raw: _Raw, scale: float) -> MeshArrays:
    if not raw.points or not raw.tets:
        raise MeshFileError(f"{path}: there is no tetrahedron in it")
    labels, points = np.concatenate(raw.labels), np.concatenate(raw.points)
    tets = _joined(raw.tets)
    order = np.argsort(labels, kind="stable")
    ordered = labels[order]
    if (ordered[1:] == ordered[:-1]).any():
        raise MeshFileError(f"{path}: two nodes have the same number")
    places = np.searchsorted(ordered, tets)
    found = np.minimum(places, len(ordered) - 1)
    missing = ordered[found] != tets
    if missing.any():
        raise MeshFileError(
            f"{path}: an element names node {int(tets[missing][0])}, which is not there"
        )
    return _checked(path, points * scale, order[found], np.concatenate(raw.regions))


def _joined(tets: list[np.ndarray[Any, Any]]) -> np.ndarray[Any, Any]:
    """Tetrahedra of several tables: with ten nodes where all have them, else their corners."""
    width = min(table.shape[1] for table in tets)
    return np.concatenate([table[:, :width] for table in tets])


def _checked(
    path: Path, points: Floats, tets: np.ndarray[Any, Any], labels: np.ndarray[Any, Any]
) -> MeshArrays:
    regions: Numbers | None = None
    if len(labels) and (labels != labels[0]).any():
        if labels.min() < 0 or labels.max() > _LABEL_MAX:
            raise MeshFileError(f"{path}: a region has a number that is negative or too large")
        regions = labels.astype(U32)
    return points, tets, regions


def _read_by_meshio(path: Path, scale: float, form: str | None) -> MeshArrays:
    try:
        import meshio
    except ImportError:
        raise MeshFileError(
            f"{path}: this is no Gmsh file in text, and meshio is not there to read another one: "
            "pip install softgrasp[meshio]"
        ) from None
    try:
        file = meshio.read(path, file_format=form)
    except SystemExit as error:
        # meshio prints a reason and ends the program.
        raise MeshFileError(f"{path}: meshio cannot read it; it has printed why") from error
    except Exception as error:
        raise MeshFileError(f"{path}: meshio cannot read it: {error}") from error
    physical = file.cell_data.get("gmsh:physical")
    tets, labels = [], []
    for block, cells in enumerate(file.cells):
        if cells.type.startswith("tetra"):
            nodes = np.asarray(cells.data)
            tets.append(nodes if cells.type == "tetra10" else nodes[:, :4])
            given = None if physical is None else np.asarray(physical[block]).reshape(-1)
            labels.append(np.zeros(len(nodes), np.int64) if given is None else given)
    if not tets:
        raise MeshFileError(f"{path}: there is no tetrahedron in it")
    points = np.asarray(file.points, dtype=np.float64) * scale
    return _checked(path, points, _joined(tets), np.concatenate(labels))
