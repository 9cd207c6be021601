//! Places that hosts ask about: their pages are fetched, and stay while somebody asks.
//!
//! In:    questions as they are asked.
//! Out:   requests to the terrain, so that the same question has an answer some frames later.
//! Keeps: tickets of at most [`TICKETS_MAX`] pages of the level that answers are of.
//! Not here: what is answered (`overfly_link`), how pages are fetched (`overfly::Overfly`).

use overfly::core::datasource::PageKey;
use overfly::core::datasource::key::PAGE_BITS;
use overfly::core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly::core::ground::{Place, Region};
use overfly::{Overfly, Ticket};
use overfly_link::cigi::{Question, Reply};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Pages of the level that are held beside the terrain's own, each with its ancestors.
const TICKETS_MAX: usize = 256;
/// New ones in one frame: each costs the frame some microseconds.
const NEW_MAX: usize = 8;
/// Different pages that one frame's questions may name.
const NAMED_MAX: usize = 1024;
/// How long a page stays after the last question about it.
const STAY_NS: u64 = 3_000_000_000;

struct Held {
    ticket: Ticket,
    asked_ns: u64,
}

/// What is asked about.
pub struct Places {
    level: u8,
    body: Ellipsoid,
    /// Pages that this frame's questions named, and a place in each.
    named: RefCell<BTreeMap<PageKey, Geodetic>>,
    held: BTreeMap<PageKey, Held>,
    /// Pages that could not be asked for: too many, or no memory for them.
    pub refused: u64,
}

impl Places {
    /// For answers of a lattice level.
    pub fn new(level: u8, body: Ellipsoid) -> Self {
        let named = RefCell::default();
        Self { level, body, named, held: BTreeMap::new(), refused: 0 }
    }

    /// Hears a question and its reply. Of lines the ends count and what was met: the ground
    /// between is as fine as the terrain has it.
    pub fn note(&self, question: &Question, reply: &Reply) {
        match *question {
            Question::Height(at) => self.name(at),
            Question::Segment { from, to } => [from, to].into_iter().for_each(|p| self.point(p)),
            Question::Ray { from, .. } => self.point(from),
        }
        if let Reply::Met(met) = reply {
            self.point(met.point);
        }
    }

    fn point(&self, point: Ecef) {
        self.name(self.body.geodetic_from_ecef(point));
    }

    fn name(&self, at: Geodetic) {
        let mut named = self.named.borrow_mut();
        if named.len() < NAMED_MAX {
            let depth = self.level.div_ceil(2).saturating_sub(PAGE_BITS);
            named.insert(Place::of(at.normal()).page(depth), at);
        }
    }

    /// Asks for what was named and is not held, and gives back what nobody asks about any more.
    pub fn follow(&mut self, overfly: &mut Overfly, now_ns: u64) {
        let named = std::mem::take(self.named.get_mut());
        let mut new = 0;
        for (key, centre) in named {
            if let Some(held) = self.held.get_mut(&key) {
                held.asked_ns = now_ns;
                continue;
            }
            if new == NEW_MAX || self.held.len() == TICKETS_MAX {
                self.refused += 1;
                continue;
            }
            new += 1;
            match overfly.request(Region { centre, radius_m: 0.0 }, self.level) {
                Ok(ticket) => drop(self.held.insert(key, Held { ticket, asked_ns: now_ns })),
                Err(_) => self.refused += 1,
            }
        }
        let old = |held: &mut Held| now_ns - held.asked_ns > STAY_NS;
        for (_, held) in self.held.extract_if(.., |_, held| old(held)) {
            overfly.release(held.ticket);
        }
    }
}
