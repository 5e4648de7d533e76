"""The ball's mesh: a round surface of triangles, filled by `glove-client fill`."""

import subprocess

import numpy as np

import task

GOLDEN = (1.0 + 5.0**0.5) / 2.0


def icosphere(times):
    """Unit vectors and triangles of an icosahedron whose triangles are cut into four so often."""
    points = [
        np.roll([0.0, a, b * GOLDEN], turn) for turn in range(3) for a in (-1, 1) for b in (-1, 1)
    ]
    points = [point / np.linalg.norm(point) for point in points]
    edge = min(np.linalg.norm(points[0] - other) for other in points[1:])
    near = [
        [k for k in range(12) if 0.0 < np.linalg.norm(points[k] - points[j]) < 1.1 * edge]
        for j in range(12)
    ]
    triangles = [
        (i, j, k) for i in range(12) for j in near[i] for k in near[i]
        if i < j < k and k in near[j]
    ]
    for _ in range(times):
        middles, finer = {}, []
        def middle(i, j):
            key = (min(i, j), max(i, j))
            if key not in middles:
                both = points[i] + points[j]
                points.append(both / np.linalg.norm(both))
                middles[key] = len(points) - 1
            return middles[key]
        for i, j, k in triangles:
            a, b, c = middle(i, j), middle(j, k), middle(k, i)
            finer += [(i, a, c), (a, j, b), (c, b, k), (a, b, c)]
        triangles = finer
    points = np.array(points)
    outwards = [
        t if np.linalg.det(points[list(t)]) > 0.0 else (t[0], t[2], t[1]) for t in triangles
    ]
    return points, np.array(outwards)


def write_mesh(folder, client, nodes):
    """Fills the ball, which lies on the table, with about so many nodes; path of the mesh."""
    points, triangles = icosphere(5)
    points = task.RADIUS * points + [0.0, 0.0, task.RADIUS]
    surface, mesh = folder / "ball.off", folder / f"ball-{nodes}.msh"
    rows = [f"OFF\n{len(points)} {len(triangles)} 0"]
    rows += [f"{x:.17g} {y:.17g} {z:.17g}" for x, y, z in points]
    rows += [f"3 {i} {j} {k}" for i, j, k in triangles]
    surface.write_text("\n".join(rows) + "\n")
    command = [client, "fill", surface, "--nodes", str(nodes), "--out", mesh]
    subprocess.run(command, check=True, capture_output=True)
    return mesh
