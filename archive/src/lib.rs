//! Terrain archives: tiles of the octahedral square in a PMTiles file, on disk or on a server.
//!
//! In:    a path or an http(s) address.
//! Out:   metadata, the bytes of single tiles.
//! Keeps: nothing.
//! Not here: what a tile's bytes mean (`overfly_core::datasource`), writing (`overfly_ingest`).
#![forbid(unsafe_code)]
