//! How calls end: status codes, and a sentence for each that failed.
//!
//! In:    faults of the façade, of handles, pointers and sizes.
//! Out:   [`ovf_status`] for the return value, the sentence for `ovf_last_error`.
//! Keeps: each thread's last sentence, in memory of its own: a fault allocates nothing here.
//! Not here: how a question to the ground was answered (`queries`).

use overfly::render_vk::{DrawError, StartError};
use overfly::{ChangeError, FrameError, OpenError, RecordError, RequestError};
use std::cell::RefCell;
use std::error::Error;
use std::ffi::c_char;
use std::fmt::{self, Write};

/// How a call ended. Where it is not `OVF_OK`, `ovf_last_error` has a sentence, and nothing was
/// changed or written but where a function says so.
#[repr(i32)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[expect(non_camel_case_types, reason = "the names are C's")]
pub enum ovf_status {
    /// Done.
    OVF_OK = 0,
    /// A pointer is null that may not be, or is not aligned.
    OVF_NULL_POINTER = 1,
    /// A `struct_size` is none that this library knows.
    OVF_STRUCT_SIZE = 2,
    /// A value is outside its range: NaN, infinite, an unknown constant, text that is not UTF-8.
    OVF_INVALID = 3,
    /// A handle was destroyed, never was, or is of another kind.
    OVF_STALE = 4,
    /// The terrain is in a call of another thread, or of this one further up.
    OVF_BUSY = 5,
    /// A buffer is too short; how much is needed was written to the count.
    OVF_SHORT_BUFFER = 6,
    /// As many as possible are open or held already.
    OVF_FULL = 7,
    /// A scene cannot be read, opened or changed to.
    OVF_SCENE = 8,
    /// The system refused a file or a thread.
    OVF_SYSTEM = 9,
    /// A page cannot be made.
    OVF_PAGE = 10,
    /// A recording cannot be begun or goes no further.
    OVF_RECORDING = 11,
    /// A bug of overfly's. The terrain or renderer that it happened in can only be destroyed.
    OVF_PANIC = 12,
    /// A call of Vulkan failed, or the device cannot draw the ground.
    OVF_VULKAN = 13,
}

pub use ovf_status::*;

/// Why a call ends: the code and the sentence.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Fault {
    /// For programs.
    pub status: ovf_status,
    /// For people: lower case, no final stop.
    pub sentence: String,
}

impl Fault {
    /// A fault with its sentence.
    pub fn new(status: ovf_status, sentence: impl Into<String>) -> Self {
        Self { status, sentence: sentence.into() }
    }

    /// A value outside its range.
    pub fn invalid(sentence: impl Into<String>) -> Self {
        Self::new(OVF_INVALID, sentence)
    }

    /// What an error says, and what caused it.
    pub fn of(status: ovf_status, error: &dyn Error) -> Self {
        let mut sentence = error.to_string();
        let mut cause = error.source();
        while let Some(error) = cause {
            let more = error.to_string();
            // Some sentences bring that of their cause along.
            if !sentence.contains(&more) {
                sentence.push_str(": ");
                sentence.push_str(&more);
            }
            cause = error.source();
        }
        Self { status, sentence }
    }
}

impl From<OpenError> for Fault {
    fn from(error: OpenError) -> Self {
        let status = match error {
            OpenError::Source(_) => OVF_SCENE,
            OpenError::Workers(_) | OpenError::Loader(_) => OVF_SYSTEM,
        };
        Self::of(status, &error)
    }
}

impl From<FrameError> for Fault {
    fn from(error: FrameError) -> Self {
        let status = match &error {
            FrameError::View(_) => OVF_INVALID,
            FrameError::Scene(ChangeError::Record(_)) | FrameError::Record(_) => OVF_RECORDING,
            FrameError::Scene(_) => OVF_SCENE,
            FrameError::Stage(_) | FrameError::Draw(_) => OVF_PANIC,
        };
        Self::of(status, &error)
    }
}

impl From<StartError> for Fault {
    fn from(error: StartError) -> Self {
        let status = match &error {
            StartError::Host { .. } | StartError::Setting { .. } => OVF_INVALID,
            _ => OVF_VULKAN,
        };
        Self::of(status, &error)
    }
}

impl From<DrawError> for Fault {
    fn from(error: DrawError) -> Self {
        let status = match &error {
            DrawError::Frame { .. } | DrawError::Range { .. } | DrawError::NothingDrawn => {
                OVF_INVALID
            }
            DrawError::Vulkan { .. } | DrawError::Memory { .. } => OVF_VULKAN,
            // A renderer is made for its terrain, which keeps what these speak of.
            _ => OVF_PANIC,
        };
        Self::of(status, &error)
    }
}

impl From<RecordError> for Fault {
    fn from(error: RecordError) -> Self {
        Self::of(OVF_RECORDING, &error)
    }
}

impl From<RequestError> for Fault {
    fn from(error: RequestError) -> Self {
        let status = match error {
            RequestError::Region(_) => OVF_INVALID,
            RequestError::Full { .. } => OVF_FULL,
            RequestError::Thread(_) => OVF_SYSTEM,
        };
        Self::of(status, &error)
    }
}

/// Longest sentence in bytes, the NUL at its end included; longer ones are cut.
const SENTENCE_BYTES: usize = 4096;

thread_local! {
    static LAST: RefCell<[u8; SENTENCE_BYTES]> = const { RefCell::new([0; SENTENCE_BYTES]) };
}

/// Writes into a buffer as long as there is room, and ends with whole characters.
struct Cut<'a> {
    into: &'a mut [u8],
    used: usize,
}

impl Write for Cut<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for letter in text.chars().filter(|&letter| letter != '\0') {
            let end = self.used + letter.len_utf8();
            // One byte stays for the NUL.
            if end >= self.into.len() {
                return Err(fmt::Error);
            }
            letter.encode_utf8(&mut self.into[self.used..end]);
            self.used = end;
        }
        Ok(())
    }
}

/// Keeps a sentence as this thread's last.
pub fn note(sentence: &str) {
    LAST.with_borrow_mut(|last| {
        let mut cut = Cut { into: last, used: 0 };
        // What does not fit is cut, which is all that can go wrong.
        let _ = cut.write_str(sentence);
        let end = cut.used;
        last[end] = 0;
    });
}

/// What went wrong in this thread's last call that failed, as one sentence in UTF-8, at most 4095
/// bytes; empty where none did. Calls that succeed leave it. It stays until the thread's next
/// failing call or its end; never null.
#[unsafe(no_mangle)]
pub extern "C" fn ovf_last_error() -> *const c_char {
    LAST.with(|last| last.as_ptr().cast::<c_char>().cast_const())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last() -> Vec<u8> {
        LAST.with_borrow(|last| last.iter().copied().take_while(|&byte| byte != 0).collect())
    }

    #[test]
    fn long_sentences_are_cut_between_characters() {
        assert_eq!(last(), b"");
        note("a\0b");
        assert_eq!(last(), b"ab");
        note(&"é".repeat(SENTENCE_BYTES));
        assert_eq!(last().len(), SENTENCE_BYTES - 2);
        assert!(String::from_utf8(last()).is_ok());
        note("");
        assert_eq!(last(), b"");
    }
}
