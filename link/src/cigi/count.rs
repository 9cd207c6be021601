//! Counts of what came, what was dropped and why, what was answered.
//!
//! In:    faults and events.
//! Out:   [`Counters`] by name, [`Held`].
//! Keeps: the counts.
//! Not here: what is counted (`decode`, `server`).

use super::decode::Fault;

/// Everything that happened since the server was made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counters {
    /// Datagrams received.
    pub datagrams: u64,
    /// Messages among them that begin with a sound IG Control.
    pub messages: u64,
    /// Packets besides IG Control that were acted upon.
    pub packets: u64,
    /// Datagrams too short for an IG Control.
    pub short: u64,
    /// Datagrams that begin with another packet.
    pub first: u64,
    /// Datagrams of another version.
    pub version: u64,
    /// Datagrams without byte-swap number.
    pub magic: u64,
    /// Packets of a wrong size.
    pub size: u64,
    /// Messages with a packet that reaches beyond their end.
    pub truncated: u64,
    /// Packets with a number that is NaN or infinite.
    pub not_finite: u64,
    /// Packets with a number out of its range.
    pub out_of_range: u64,
    /// Further IG Controls in a message.
    pub repeated: u64,
    /// Packets of CIGI that are not served.
    pub ignored: u64,
    /// Packets that CIGI does not define.
    pub unknown: u64,
    /// Packets that came in Reset/Standby.
    pub standby: u64,
    /// Packets about an entity that is not there, or cannot be attached.
    pub no_entity: u64,
    /// Entities beyond the most that may be.
    pub entities_full: u64,
    /// Views and groups beyond the most that may be.
    pub views_full: u64,
    /// Requests beyond the most that may wait.
    pub requests_full: u64,
    /// Earth models other than the scene's.
    pub earth_models: u64,
    /// Responses sent.
    pub responses: u64,
    /// Responses among them whose Valid is 0.
    pub invalid: u64,
    /// Responses that waited for room in a later message.
    pub delayed: u64,
    /// Start Of Frames sent.
    pub frames: u64,
}

impl Counters {
    /// By name, in a fixed order.
    pub fn columns(&self) -> [(&'static str, u64); 24] {
        [
            ("datagrams", self.datagrams),
            ("messages", self.messages),
            ("packets", self.packets),
            ("dropped: short", self.short),
            ("dropped: no IG Control", self.first),
            ("dropped: version", self.version),
            ("dropped: byte-swap number", self.magic),
            ("dropped: size", self.size),
            ("dropped: truncated", self.truncated),
            ("dropped: not finite", self.not_finite),
            ("dropped: out of range", self.out_of_range),
            ("dropped: second IG Control", self.repeated),
            ("dropped: in standby", self.standby),
            ("dropped: no such entity", self.no_entity),
            ("dropped: too many entities", self.entities_full),
            ("dropped: too many views", self.views_full),
            ("dropped: too many requests", self.requests_full),
            ("passed over: not served", self.ignored),
            ("passed over: unknown", self.unknown),
            ("earth models refused", self.earth_models),
            ("responses", self.responses),
            ("responses not valid", self.invalid),
            ("responses delayed", self.delayed),
            ("frames", self.frames),
        ]
    }

    pub(super) fn fault(&mut self, fault: Fault) {
        *match fault {
            Fault::Short => &mut self.short,
            Fault::First => &mut self.first,
            Fault::Version => &mut self.version,
            Fault::Magic => &mut self.magic,
            Fault::Size => &mut self.size,
            Fault::Truncated => &mut self.truncated,
            Fault::NotFinite => &mut self.not_finite,
            Fault::OutOfRange => &mut self.out_of_range,
            Fault::Repeated => &mut self.repeated,
            Fault::Ignored => &mut self.ignored,
            Fault::Unknown => &mut self.unknown,
        } += 1;
    }
}

/// How much a server holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Held {
    /// Entities.
    pub entities: usize,
    /// Views.
    pub views: usize,
    /// View groups.
    pub groups: usize,
    /// Requests that are answered again and again.
    pub standing: usize,
    /// Requests that wait for their one answer.
    pub once: usize,
}
