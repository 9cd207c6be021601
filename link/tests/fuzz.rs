//! A hundred thousand bad datagrams: the server lives, holds no more than it may, and goes on.
//!
//! In:    sound messages, mutated; noise.
//! Out:   passes or fails; the counts.
//! Keeps: nothing. Alone in its binary, so that the memory of the process is its own.
//! Not here: what sound messages do (`session`, `answers`).

mod host;

use host::*;
use overfly_core::digest::mix;
use overfly_core::geodesy::{Ellipsoid, narrow};
use overfly_link::cigi::{
    ENTITIES_MAX, GROUPS_MAX, ONCE_MAX, Question, Reply, STANDING_MAX, VIEWS_MAX, World,
};

const DATAGRAMS: u64 = 100_000;

struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        mix(self.0)
    }

    fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.next() % end.max(1) as u64).expect("below a usize")
    }

    fn byte(&mut self) -> u8 {
        self.next().to_le_bytes()[0]
    }

    fn number(&mut self) -> f64 {
        match self.below(80) {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => -0.0,
            3 => f64::from_bits(self.next()),
            _ => 182.0 * unit(self.next()) - 91.0,
        }
    }

    fn three(&mut self) -> [f64; 3] {
        [self.number(), self.number(), self.number()]
    }

    fn floats<const N: usize>(&mut self) -> [f32; N] {
        [0; N].map(|_| narrow(self.number()))
    }
}

/// A message of some packets with numbers of all kinds.
fn message(noise: &mut Noise) -> Vec<u8> {
    let mode = if noise.below(20_000) == 0 { 0 } else { 1 + noise.byte() % 2 };
    let mut host = Host::new(noise.byte() & 1 == 0, u32::from(noise.byte()) << 20, (mode, 0));
    for _ in 0..noise.below(12) {
        let id = noise.next().to_le_bytes();
        let id = u16::from_le_bytes([id[0], id[1]]);
        let entity = (noise.below(3) == 0).then_some(id % 300);
        let period = noise.byte() % 4;
        match noise.below(9) {
            0 | 1 => {
                let bits = noise.byte();
                let parent = noise.byte().into();
                host.entity((id, parent, bits), noise.three(), noise.floats());
            }
            2 => host.view_control((id, noise.byte() % 40), 0, noise.byte(), noise.floats()),
            3 => host.view_definition((id, noise.byte() % 40), noise.byte(), noise.floats()),
            4 => host.clamped(id % 2000, 0.0, [noise.number(), noise.number()]),
            5 => host.earth(true, noise.number(), noise.number()),
            6 => host.hat_hot((id, noise.byte() % 4, period), entity, noise.three()),
            7 => {
                let (from, to) = (noise.three(), noise.three());
                host.segment((id, true, period), (entity, from), (None, to));
            }
            _ => host.vector((id, false, period), (entity, noise.three()), noise.floats()),
        }
    }
    host.bytes
}

/// What the way to the server, or malice, makes of it.
fn mutate(bytes: &mut Vec<u8>, noise: &mut Noise) {
    match noise.below(8) {
        0 => bytes.truncate(noise.below(bytes.len() + 1)),
        1 => bytes.extend((0..noise.below(400)).map(|_| noise.byte())),
        2 => *bytes = (0..noise.below(300)).map(|_| noise.byte()).collect(),
        3 => {
            let at = noise.below(bytes.len());
            bytes[at] = noise.byte();
        }
        4 => {
            for _ in 0..noise.below(30) {
                let at = noise.below(bytes.len());
                bytes[at] ^= 1 << noise.below(8);
            }
        }
        5 if bytes.len() > 25 => bytes[25] = noise.byte(),
        6 if bytes.len() > 24 => {
            let at = 24 + noise.below(bytes.len() - 24);
            bytes.drain(24..at);
        }
        _ => {}
    }
}

/// Pages of the process that are in memory, times 4 KiB; empty where nobody says.
fn resident_kib() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(4 * text.split(' ').nth(1)?.parse::<u64>().ok()?)
}

#[test]
fn a_hundred_thousand_bad_datagrams_leave_the_server_alive_and_its_memory_bounded() {
    let mut server = server();
    let mut noise = Noise(20_260_101);
    let mut out = Vec::new();
    let body = Ellipsoid::WGS84;
    let ask = |question: &Question| match question {
        Question::Height(_) => Reply::Unknown,
        _ => Reply::Clear,
    };
    let world = World { body, sea_level_m: &sea_level_m, ask: &ask };
    let mut views = Vec::new();
    let mut most = [0_usize; 5];
    let mut settled_kib = None;
    for index in 0..DATAGRAMS {
        let mut bytes = message(&mut noise);
        mutate(&mut bytes, &mut noise);
        server.receive(&bytes);
        if index % 50 == 0 {
            server.views(&world, [640, 480], &mut views);
            assert!(views.len() <= VIEWS_MAX && views.iter().all(|view| view.check().is_ok()));
            server.frame(&world, SETTLED, &mut out);
            assert!(out.len() <= 65_507 && !packets(&out).is_empty());
        }
        let held = server.held();
        let now = [held.entities, held.views, held.groups, held.standing, held.once];
        most = core::array::from_fn(|kind| most[kind].max(now[kind]));
        if index == DATAGRAMS / 2 {
            settled_kib = resident_kib();
        }
    }
    let bounds = [ENTITIES_MAX, VIEWS_MAX, GROUPS_MAX, STANDING_MAX, ONCE_MAX];
    println!("most held {most:?} of {bounds:?}");
    assert!(most.iter().zip(bounds).all(|(&most, bound)| most <= bound), "{most:?}");
    assert!(most[0] > 500 && most[1] == VIEWS_MAX && most[3] > 1000, "it was put under load");
    let counters = *server.counters();
    counters.columns().iter().for_each(|(name, count)| println!("{count:>9} {name}"));
    assert_eq!(counters.datagrams, DATAGRAMS);
    for (name, count) in counters.columns() {
        let may_be_none = ["dropped: too many", "earth", "responses delayed"];
        assert!(count > 0 || may_be_none.iter().any(|may| name.starts_with(may)), "{name}: none");
    }
    if let Some((before, after)) = settled_kib.zip(resident_kib()) {
        println!("resident {before} KiB half-way, {after} KiB at the end");
        assert!(after <= before + 2048, "{before} KiB became {after} KiB");
    }
    // And it still serves.
    server.receive(&Host::new(false, 1, (0, 0)).bytes);
    let mut host = Host::new(true, 2, (1, 0));
    host.entity((0, 0, 1), [1.0, 2.0, 3.0], [0.0; 3]);
    host.hat_hot((5, 0, 0), None, [1.0, 2.0, 3.0]);
    assert!(server.receive(&host.bytes));
    server.frame(&world, SETTLED, &mut out);
    assert_eq!(packets(&out)[1].u16(2), 5);
    server.views(&world, [640, 480], &mut views);
    assert_eq!(views.len(), 1);
}
