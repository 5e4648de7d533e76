"""Meshes and their files."""

from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

from softgrasp import Mesh, MeshFileError

MSH_2 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
3 9 "soft"
$EndPhysicalNames
$Nodes
6
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 1
50 1 1 1
60 9 9 9
$EndNodes
$Elements
4
1 15 2 0 1 10
2 2 2 5 1 10 20 30
3 4 2 9 1 10 20 30 40
4 4 3 0 4 1 50 30 20 40
$EndElements
$ElementData
1
"a view"
$EndElementData
"""

MSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
1 0 1 2
1 0 0 0 0
1 0 0 0 1 1 1 0 0
4 0 0 0 1 1 1 1 9 0
5 0 0 0 1 1 1 0 0
$EndEntities
$Nodes
2 5 1 5
0 1 0 1
5
1 1 1
3 4 0 4
1
2
3
4
0 0 0
1 0 0
0 1 0
0 0 1
$EndNodes
$Elements
3 3 1 3
2 1 2 1
1 1 2 3
3 4 4 1
2 1 2 3 4
3 5 11 1
3 5 3 2 4 1 1 1 1 1 1
$EndElements
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "mesh.msh"
    path.write_text(text)
    return path


def test_block_fills_its_box() -> None:
    mesh = Mesh.block((0.04, 0.03, 0.02), (4, 3, 2))
    assert mesh.node_count == 5 * 4 * 3 and len(mesh.tets) == 6 * 24
    assert mesh.volume == pytest.approx(0.04 * 0.03 * 0.02)
    assert len(mesh.boundary) == 2 * 2 * (4 * 3 + 3 * 2 + 4 * 2)
    assert len(mesh.boundary_nodes) == 60 - 3 * 2 * 1
    assert mesh.nodes_at(x=0.04, z=0.0).tolist() == [4, 9, 14, 19]
    assert mesh.nearest_node((0.04, 0.03, 0.02)) == 59


def test_boundary_looks_outward_whatever_the_order_of_corners() -> None:
    mesh = Mesh.block((1.0, 1.0, 1.0), (2, 2, 2))
    shuffled = Mesh(mesh.points, np.random.default_rng(5).permuted(mesh.tets, axis=1))
    for each in (mesh, shuffled):
        a, b, c = (each.points[each.boundary[:, corner]] for corner in range(3))
        # By the theorem of Gauss the flux of x/3 through the boundary is the volume.
        flux = np.einsum("ij,ij->i", (a + b + c) / 9.0, np.cross(b - a, c - a) / 2.0).sum()
        assert flux == pytest.approx(1.0)


def test_gmsh_2_has_labels_regions_and_other_elements(tmp_path: Path) -> None:
    mesh = Mesh.read(written(tmp_path, MSH_2), scale=0.01)
    assert mesh.points[4].tolist() == [0.01, 0.01, 0.01] and mesh.node_count == 6
    assert mesh.tets.tolist() == [[0, 1, 2, 3], [4, 2, 1, 3]]
    assert mesh.regions is not None and mesh.regions.tolist() == [9, 4]


def test_gmsh_4_has_blocks_and_physical_groups(tmp_path: Path) -> None:
    mesh = Mesh.read(written(tmp_path, MSH_41))
    assert mesh.points[0].tolist() == [1.0, 1.0, 1.0]
    assert mesh.tets.tolist() == [[1, 2, 3, 4], [0, 3, 2, 4]]
    assert mesh.regions is not None and mesh.regions.tolist() == [9, 5]


@pytest.mark.parametrize("name", ["msh1", "msh2", "cube-msh"])
def test_files_of_the_repository_are_read(name: str) -> None:
    path = ROOT / "fuzz" / "seeds" / "mesh" / name
    if not path.exists():
        pytest.skip(f"{path} is not there")
    mesh = Mesh.read(path)
    expected = {"msh1": (5, 2), "msh2": (5, 2), "cube-msh": (27, 48)}[name]
    assert (mesh.node_count, len(mesh.tets)) == expected
    assert mesh.regions is None


MSH_2_TEN = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
10
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
5 0.5 -0.1 0
6 0.5 0.5 0
7 0 0.5 0
8 0 0 0.5
9 0 0.5 0.5
10 0.5 0 0.5
$EndNodes
$Elements
1
1 11 2 0 1 1 2 3 4 5 6 7 8 9 10
$EndElements
"""


def test_mid_edge_nodes_are_kept_where_every_tetrahedron_has_them(tmp_path: Path) -> None:
    mesh = Mesh.read(written(tmp_path, MSH_2_TEN))
    # Gmsh has the edge from 3 to 4 before that from 2 to 4.
    assert mesh.tets.tolist() == [[0, 1, 2, 3]]
    assert mesh.mid_edge is not None and mesh.mid_edge.tolist() == [[4, 5, 6, 7, 9, 8]]
    mixed = MSH_2_TEN.replace("$Elements\n1\n", "$Elements\n2\n2 4 2 0 1 2 3 4 1\n")
    mesh = Mesh.read(written(tmp_path, mixed))
    assert mesh.mid_edge is None and len(mesh.tets) == 2
    for wrong in ([[4, 5, 6, 7, 9]], [[4, 5, 6, 7, 9, 10]], np.zeros((2, 6), int)):
        with pytest.raises(ValueError, match="mid-edge"):
            Mesh(np.zeros((10, 3)), [[0, 1, 2, 3]], mid_edge=wrong)


def test_mid_edge_nodes_are_read_by_meshio(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    mesh = Mesh.read(written(tmp_path, MSH_2_TEN))
    assert mesh.mid_edge is not None
    nodes = np.concatenate([mesh.tets, mesh.mid_edge], axis=1).astype(int)
    file = meshio.Mesh(mesh.points, [("tetra10", nodes)])
    for name in ("a.vtu", "a.vtk", "a.inp"):
        meshio.write(tmp_path / name, file)
        again = Mesh.read(tmp_path / name)
        assert np.array_equal(again.tets, mesh.tets), name
        assert again.mid_edge is not None and np.array_equal(again.mid_edge, mesh.mid_edge), name


def test_other_formats_are_read_by_meshio(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    block = Mesh.block((1.0, 2.0, 3.0), (1, 2, 1))
    labels = np.arange(len(block.tets)) % 2 + 1
    file = meshio.Mesh(
        block.points,
        [("tetra", block.tets.astype(int))],
        cell_data={"gmsh:physical": [labels], "gmsh:geometrical": [labels]},
    )
    for name, form in [("a.vtu", "vtu"), ("a.msh", "gmsh22"), ("a.mesh", "medit")]:
        meshio.write(tmp_path / name, file, file_format=form)
        mesh = Mesh.read(tmp_path / name)
        assert np.array_equal(mesh.points, block.points), name
        assert np.array_equal(mesh.tets, block.tets), name
        # The content tells, not the name.
        other = tmp_path / "misnamed.dat"
        other.write_bytes((tmp_path / name).read_bytes())
        assert np.array_equal(Mesh.read(other).tets, block.tets), name
    # Binary Gmsh, which the own reader leaves to meshio.
    binary = Mesh.read(tmp_path / "a.msh")
    assert binary.regions is not None and binary.regions.tolist() == labels.tolist()


@pytest.mark.parametrize("text", [MSH_2, MSH_41])
def test_damaged_files_are_refused_with_their_place(tmp_path: Path, text: str) -> None:
    lines = text.splitlines()
    for cut in range(3, len(lines)):
        try:
            Mesh.read(written(tmp_path, "\n".join(lines[:cut])))
        except MeshFileError as error:
            assert "mesh.msh" in str(error)
    for line in range(3, len(lines)):
        for word in ("x", "-1", "99999999999999999999", "1e400", ""):
            damaged = [*lines[:line], word, *lines[line + 1 :]]
            try:
                Mesh.read(written(tmp_path, "\n".join(damaged)))
            except MeshFileError as error:
                assert "mesh.msh" in str(error)


def test_refusals_of_files(tmp_path: Path) -> None:
    with pytest.raises(MeshFileError, match="node 41"):
        Mesh.read(written(tmp_path, MSH_2.replace("10 20 30 40\n", "10 20 30 41\n")))
    with pytest.raises(MeshFileError, match="same number"):
        Mesh.read(written(tmp_path, MSH_2.replace("60 9 9 9", "10 9 9 9")))
    with pytest.raises(MeshFileError, match=r"line 9: .*announced"):
        Mesh.read(written(tmp_path, MSH_2.replace("$Nodes\n6\n", "$Nodes\n600000000\n")))
    with pytest.raises(MeshFileError, match="physical groups"):
        Mesh.read(written(tmp_path, MSH_41.replace("1 1 1 1 9 0", "1 1 1 1 soft 0")))
    for version in ("nan", "inf", "soft"):
        with pytest.raises(MeshFileError, match="version"):
            Mesh.read(written(tmp_path, MSH_2.replace("2.2 0 8", f"{version} 0 8")))
    with pytest.raises(MeshFileError):
        Mesh.read(written(tmp_path, "no mesh at all"))
    with pytest.raises(FileNotFoundError):
        Mesh.read(tmp_path / "nothing.msh")
