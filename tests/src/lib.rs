//! Helpers shared by the system tests: meshes, servers, a faulty proxy.
