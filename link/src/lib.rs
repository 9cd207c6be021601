//! What simulators say over a network, as plain data: bytes in, state, bytes out.
//!
//! In:    datagrams of CIGI 3.3 hosts and of FlightGear; answers about the ground.
//! Out:   views, poses, requests, datagrams of responses; counts of what was dropped.
//! Keeps: [`cigi::Server`]: entities, views, requests, each in bounded number.
//! Not here: sockets and clocks (`overfly serve`), the ground itself (`overfly_core::ground`).
#![forbid(unsafe_code)]

pub mod cigi;
pub mod fgfs;
mod wire;

pub use wire::ByteOrder;
