//! CIGI 3.3, the Common Image Generator Interface, from the image generator's side.
//!
//! In:    datagrams of a host, answers about the ground.
//! Out:   views to serve, datagrams with Start Of Frame and responses, counts.
//! Keeps: [`Server`].
//! Not here: sockets and clocks; the ground (`overfly_core::ground`).
//! Source: CIGI ICD 3.3 (Boeing, 2008, public domain) as its Perl binding Rinchi-CIGIPP 0.02
//! quotes it attribute by attribute; offsets and bits checked against the CIGI Class Library 3.3
//! (Hadron/cigi-ccl) and a C++23 implementation (Dnarok/cigi).
//!
//! `docs/serving.md` says which packets and fields are used and what could not be verified.

mod count;
mod decode;
mod encode;
mod entities;
mod packet;
mod pose;
mod question;
mod requests;
mod server;
mod views;

pub use count::{Counters, Held};
pub use decode::{Fault, Message};
pub use packet::{
    Attitude, Clamp, ClampedEntity, EntityControl, EntityState, HatHot, HatHotKind, HostPacket,
    IgControl, MslPlace, Placed, Segment, Spot, Vector, ViewControl, ViewDefinition, ViewTarget,
};
pub use packet::{EarthModel, Mode};
pub use question::{
    Asked, MATERIAL_GROUND, MATERIAL_WATER, Met, Question, Reply, Surface, World, ask,
};
pub use server::{FrameFacts, Server, Setup};
pub use views::Lens;

/// Most entities at a time.
pub const ENTITIES_MAX: usize = 1024;
/// Most views at a time.
pub const VIEWS_MAX: usize = 8;
/// Most view groups at a time.
pub const GROUPS_MAX: usize = 16;
/// Most requests that are answered again and again.
pub const STANDING_MAX: usize = 4096;
/// Most requests that wait for their one answer.
pub const ONCE_MAX: usize = 4096;
/// Longest chain of entities attached to each other.
pub const CHAIN_MAX: usize = 16;
/// Least and most bytes of a message to the host.
pub const MESSAGE_BYTES: [usize; 2] = [256, 65_507];
