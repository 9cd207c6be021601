//! Geodesy, octahedron lattice, camera, datasource, LOD and mesh of overfly.
