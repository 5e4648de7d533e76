//! Octree of spheres over the surface vertices (thesis 4.2–4.4).
