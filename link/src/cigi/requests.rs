//! Requests that wait: those answered once, and those answered every so many frames.
//!
//! In:    requests, the number of the frame.
//! Out:   which are due, the longest waiting first.
//! Keeps: at most [`ONCE_MAX`] and [`STANDING_MAX`] of them.
//! Not here: answers (`server`).

use super::packet::{HatHot, HatHotKind, Segment, Spot, Vector};
use super::{ONCE_MAX, STANDING_MAX, encode};
use std::collections::{BTreeMap, VecDeque};

/// A request of any kind.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Request {
    HatHot(HatHot),
    Segment(Segment),
    Vector(Vector),
}

impl Request {
    /// Heights and lines have numbers of their own; segments and vectors share theirs.
    fn key(&self) -> (bool, u16) {
        match self {
            Self::HatHot(request) => (false, request.id),
            Self::Segment(request) => (true, request.id),
            Self::Vector(request) => (true, request.id),
        }
    }

    fn period(&self) -> u8 {
        match self {
            Self::HatHot(request) => request.period,
            Self::Segment(request) => request.period,
            Self::Vector(request) => request.period,
        }
    }

    /// Bytes of its response.
    pub fn response_bytes(&self) -> usize {
        let [_, size] = match self {
            Self::HatHot(HatHot { kind: HatHotKind::Extended, .. }) => encode::HAT_HOT_EXTENDED,
            Self::HatHot(_) => encode::HAT_HOT,
            Self::Segment(Segment { extended: true, .. })
            | Self::Vector(Vector { extended: true, .. }) => encode::LINE_EXTENDED,
            Self::Segment(_) | Self::Vector(_) => encode::LINE,
        };
        usize::from(size)
    }

    /// Whether a point of it is given in the axes of an entity that fulfils this.
    fn hangs_on(&self, gone: &impl Fn(u16) -> bool) -> bool {
        let hangs = |spot: &Spot| matches!(spot, Spot::Body { entity, .. } if gone(*entity));
        match self {
            Self::HatHot(request) => hangs(&request.at),
            Self::Segment(request) => hangs(&request.from) || hangs(&request.to),
            Self::Vector(request) => hangs(&request.from),
        }
    }
}

/// Where a due request is kept.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kept {
    Once(usize),
    Standing((bool, u16)),
}

struct Standing {
    request: Request,
    due: u64,
}

/// All requests of a host.
#[derive(Default)]
pub struct Requests {
    once: VecDeque<(u64, Request)>,
    standing: BTreeMap<(bool, u16), Standing>,
    due: Vec<(u64, Kept)>,
}

impl Requests {
    pub fn once(&self) -> usize {
        self.once.len()
    }

    pub fn standing(&self) -> usize {
        self.standing.len()
    }

    pub fn clear(&mut self) {
        self.once.clear();
        self.standing.clear();
    }

    /// Takes a request in, for the next frame. One of the same name that stands is replaced; where
    /// the new one is for once, that ends it. False where there are too many.
    pub fn add(&mut self, request: Request, frame: u64) -> bool {
        let key = request.key();
        if request.period() == 0 {
            self.standing.remove(&key);
            let room = self.once.len() < ONCE_MAX;
            if room {
                self.once.push_back((frame, request));
            }
            return room;
        }
        if !self.standing.contains_key(&key) && self.standing.len() >= STANDING_MAX {
            return false;
        }
        self.standing.insert(key, Standing { request, due: frame });
        true
    }

    /// Ends standing requests in the axes of entities that are gone.
    pub fn end_of(&mut self, gone: &impl Fn(u16) -> bool) {
        self.standing.retain(|_, standing| !standing.request.hangs_on(gone));
    }

    /// Hands out what is due, the longest waiting first, until `answer` has no room; returns how
    /// many still wait.
    pub fn serve(&mut self, frame: u64, mut answer: impl FnMut(&Request) -> bool) -> usize {
        self.due.clear();
        let once = self.once.iter().enumerate().map(|(index, (due, _))| (*due, Kept::Once(index)));
        self.due.extend(once);
        let standing = self.standing.iter().filter(|(_, standing)| standing.due <= frame);
        self.due.extend(standing.map(|(&key, standing)| (standing.due, Kept::Standing(key))));
        self.due.sort_unstable();
        let (mut served, mut once) = (0, 0);
        for &(_, kept) in &self.due {
            let request = match kept {
                Kept::Once(index) => self.once[index].1,
                Kept::Standing(key) => self.standing[&key].request,
            };
            if !answer(&request) {
                break;
            }
            served += 1;
            match kept {
                Kept::Once(_) => once += 1,
                Kept::Standing(key) => {
                    let standing = self.standing.get_mut(&key).expect("it was just read");
                    standing.due = frame + u64::from(request.period());
                }
            }
        }
        // They came in order, so those that were answered are the first.
        self.once.drain(..once);
        self.due.len() - served
    }
}
