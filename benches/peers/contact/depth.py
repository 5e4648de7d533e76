"""How deep a surface of triangles lies in the fingertips and in the table."""

import numpy as np

import task


def deepest(points, triangles, tips, skin=0.0):
    """Depth of the deepest point, m; `skin` is the thickness of the surface. 0 where none is in."""
    corners = points[triangles]
    depth = skin - points[np.unique(triangles), 2].min()
    for tip in tips:
        near = np.linalg.norm(corners - tip, axis=2).min(axis=1) < 3.0 * task.TIP
        if near.any():
            away = distances(corners[near], tip).min()
            depth = max(depth, task.TIP + skin - away)
    return max(float(depth), 0.0)


def distances(corners, point):
    """From a point to triangles; `corners` has shape (triangles, 3, 3)."""
    a = corners[:, 0]
    edges = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(edges[:, 0], -edges[:, 2])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    to_corners = point - corners
    sides = np.einsum("tk,tek->te", normals, np.cross(edges, to_corners))
    shares = np.einsum("tek,tek->te", edges, to_corners) / np.einsum("tek,tek->te", edges, edges)
    on_edges = corners + np.clip(shares, 0.0, 1.0)[:, :, None] * edges
    to_edges = np.linalg.norm(point - on_edges, axis=2).min(axis=1)
    to_planes = np.abs(np.einsum("tk,tk->t", normals, point - a))
    return np.where((sides >= 0.0).all(axis=1), to_planes, to_edges)
