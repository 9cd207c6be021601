//! A window to fly in: nothing happens in it that a recording does not keep.
//!
//! | module | what it holds |
//! |---|---|
//! | [`window`] | the window: events become actions, a redraw becomes a frame |
//! | [`session`], [`turn`] | the state that actions change; one frame of it |
//! | [`keys`], [`script`] | what keys do; texts that stand in for hands |
//! | [`fly`], [`play`], [`track`] | the free eye; the flight's clock; the flight's views |
//! | [`hud`], [`screenshot`] | numbers over the picture; pictures with their sidecars |
//!
//! In:    a plan: scene, flight, where to begin, what to record.
//! Out:   pictures on the screen, recordings, screenshots.
//! Keeps: nothing beyond the window's life.
//! Not here: arguments (`cli::view`), drawing (`overfly_render_vk`).

pub mod fly;
pub mod hud;
pub mod keys;
pub mod play;
pub mod screenshot;
pub mod script;
pub mod session;
pub mod track;
mod turn;
pub mod window;
