//! The border: what C hands over becomes checked values, and nothing unwinds into C.
//!
//! In:    raw pointers, counts, structs that say their own size.
//! Out:   copies of structs, views of arrays, texts; faults where a pointer or size is wrong.
//! Keeps: nothing.
//! Not here: functions of the host that we call (`callbacks`), what values mean.
//!
//! A C function's body is `answer!(|caller| …)`. The `unsafe` of all of them is in that macro: the
//! caller vouches for its pointers, a [`Caller`] stands for that, and nobody else can make one.

use crate::status::{
    Fault, OVF_NULL_POINTER, OVF_OK, OVF_PANIC, OVF_SHORT_BUFFER, OVF_STRUCT_SIZE, note, ovf_status,
};
use bytemuck::Zeroable;
use std::any::Any;
use std::ffi::{CStr, c_char};
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Answers a call from C: runs the body with a [`Caller`]; ends in a status.
macro_rules! answer {
    ($body:expr) => {
        // SAFETY: the function this stands in takes no pointers, or it is `unsafe` and its caller
        // keeps the rules of pointers at the head of `overfly.h`: what `Caller::answer` asks for.
        unsafe { $crate::border::Caller::answer($body) }
    };
}
pub(crate) use answer;

/// Stands for the promise of who called us: its pointers are null or good until the call ends, for
/// as many elements as it says, and nobody else writes there meanwhile.
pub struct Caller(());

/// A struct that begins with its own size. All bits of it may be anything, and later versions only
/// add fields at the end, for which 0 means what there was before.
///
/// # Safety
/// `repr(C)`, the first field is a `u32` of the size in bytes, and every pattern of bits is sound.
pub unsafe trait Sized32: Copy + Zeroable {
    /// Its name in C.
    const NAME: &'static str;
    /// Size of its first version.
    const LEAST: usize;
}

/// Structs that say their own size. What stands beside each is the size of its first version.
macro_rules! sized {
    ($($name:path: $least:expr,)*) => {$(
        const _: () = assert!($least <= size_of::<$name>() && align_of::<$name>() <= 8);
        // SAFETY: it is `repr(C)`, begins with `struct_size: u32`, and holds only numbers, pointers
        // and optional functions, which are not called before they are looked at.
        unsafe impl Sized32 for $name {
            const NAME: &'static str = {
                let path = stringify!($name).as_bytes();
                let mut at = path.len();
                while at > 0 && path[at - 1] != b':' && path[at - 1] != b' ' {
                    at -= 1;
                }
                match std::str::from_utf8(path.split_at(at).1) {
                    Ok(name) => name,
                    Err(_) => panic!("names are ASCII"),
                }
            };
            const LEAST: usize = $least;
        }
    )*};
}

sized! {
    crate::scene::ovf_scene: 32,
    crate::scene::ovf_edit: 64,
    crate::host::ovf_host: 64,
    crate::frame::ovf_view: 144,
    crate::frame::ovf_frame_input: 40,
    crate::frame::ovf_frame: 112,
    crate::columns::ovf_limits: 64,
    crate::columns::ovf_patch_columns: 56,
    crate::columns::ovf_eye: 192,
    crate::renderer::ovf_device: 64,
    crate::renderer::ovf_target: 32,
    crate::renderer::ovf_renderer_settings: 8,
    crate::drawing::ovf_host_frame: 16,
    crate::drawing::ovf_picture: 16,
    crate::drawing::ovf_draw_report: 40,
    crate::overlay::ovf_overlay: 32,
    crate::overlay::ovf_overlay_shape: 48,
    crate::overlay::ovf_overlay_segment: 56,
    crate::renderer::ovf_device_memory: 16,
    crate::queries::ovf_query: 24,
    crate::queries::ovf_places: 40,
    crate::queries::ovf_height: 72,
    crate::queries::ovf_height_columns: 72,
    crate::queries::ovf_contact: 104,
    crate::rays::ovf_hit: 72,
    crate::rays::ovf_sight: 80,
    crate::regions::ovf_region: 32,
    crate::regions::ovf_readiness: 24,
    crate::regions::ovf_min_max: 32,
}

/// An array that C lets us read. It may overlap with what we write.
#[derive(Clone, Copy)]
pub struct In<'a, T> {
    start: *const T,
    count: usize,
    caller: PhantomData<&'a Caller>,
}

impl<T: Copy> In<'_, T> {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// One of them.
    pub fn get(&self, index: usize) -> T {
        assert!(index < self.count, "{index} of {}", self.count);
        // SAFETY: the caller vouched for `count` elements, and `T` is numbers, where any bits do.
        unsafe { self.start.add(index).read() }
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = T> + '_ {
        (0..self.count).map(|index| self.get(index))
    }
}

/// An array that C lets us write, and that nobody reads here.
pub struct Out<'a, T> {
    start: *mut T,
    count: usize,
    caller: PhantomData<&'a Caller>,
}

impl<T: Copy> Out<'_, T> {
    /// Writes one of them; nothing where C did not want this array at all.
    pub fn put(&self, index: usize, value: T) {
        if self.start.is_null() {
            return;
        }
        assert!(index < self.count, "{index} of {}", self.count);
        // SAFETY: the caller vouched for `count` elements that we may write.
        unsafe { self.start.add(index).write(value) }
    }
}

impl Caller {
    /// Runs the body of a C function. A fault or a panic becomes this thread's last sentence.
    ///
    /// # Safety
    /// - Pointers that `body` gives to the methods are null, or good until this returns for as many
    ///   elements as `body` says, to be read or written as the methods say.
    /// - No other thread writes there meanwhile.
    pub unsafe fn answer(body: impl FnOnce(&Caller) -> Result<(), Fault>) -> ovf_status {
        let outcome = catch_unwind(AssertUnwindSafe(|| body(&Caller(()))));
        let fault = match outcome {
            Ok(Ok(())) => return OVF_OK,
            Ok(Err(fault)) => fault,
            Err(panic) => Fault::new(OVF_PANIC, format!("a bug of overfly: {}", words(panic))),
        };
        note(&fault.sentence);
        fault.status
    }

    /// Copies a struct in, whatever its version; fields that an older one lacks are 0.
    pub fn sized<T: Sized32>(&self, name: &str, at: *const T) -> Result<T, Fault> {
        let size = self.size_of(name, at)?;
        let mut value = T::zeroed();
        // SAFETY: the caller vouches for as many bytes as the struct says, that is no more than `T`
        // has, and any bits make a `T`.
        unsafe { at.cast::<u8>().copy_to_nonoverlapping((&raw mut value).cast(), size) };
        Ok(value)
    }

    /// Copies one of several structs in, which all say the same size.
    pub fn sized_at<T: Sized32>(
        &self,
        name: &str,
        start: *const T,
        index: usize,
    ) -> Result<T, Fault> {
        let stride = self.size_of(name, start)?;
        // SAFETY: the caller vouches for so many structs of that size.
        let at = unsafe { start.byte_add(index * stride) };
        let size = self.size_of(name, at)?;
        if size != stride {
            let sentence = format!(
                "{name}: struct_size is {size} in [{index}] and {stride} in [0], allowed is the same"
            );
            return Err(Fault::new(OVF_STRUCT_SIZE, sentence));
        }
        self.sized(name, at)
    }

    /// Looks at a struct that is to be written, before anything is done.
    pub fn check_out<T: Sized32>(&self, name: &str, at: *mut T) -> Result<(), Fault> {
        self.size_of(name, at.cast_const()).map(|_| ())
    }

    /// Writes a struct, as much of it as C's version has; its `struct_size` stays as it is.
    pub fn put<T: Sized32>(&self, name: &str, at: *mut T, value: T) -> Result<(), Fault> {
        let size = self.size_of(name, at.cast_const())?;
        let (from, to) = ((&raw const value).cast::<u8>(), at.cast::<u8>());
        // SAFETY: as in `sized`, the other way round; the first four bytes are skipped on both
        // sides.
        unsafe { from.add(4).copy_to_nonoverlapping(to.add(4), size - 4) };
        Ok(())
    }

    fn size_of<T: Sized32>(&self, name: &str, at: *const T) -> Result<usize, Fault> {
        refuse_pointer(name, at)?;
        // SAFETY: the caller vouches for a struct there, and each begins with its size.
        let found = unsafe { at.cast::<u32>().read() };
        let (least, most) = (T::LEAST, size_of::<T>());
        let size = usize::try_from(found).unwrap_or(usize::MAX);
        if (least..=most).contains(&size) && size % align_of::<T>() == 0 {
            return Ok(size);
        }
        let sentence = format!(
            "{name}: struct_size is {found}, allowed for {} is {least} to {most}: set it to \
             sizeof({})",
            T::NAME,
            T::NAME
        );
        Err(Fault::new(OVF_STRUCT_SIZE, sentence))
    }

    /// An array to read. Null is allowed where there are none.
    pub fn array<'a, T: Copy>(
        &'a self,
        name: &str,
        start: *const T,
        count: u64,
    ) -> Result<In<'a, T>, Fault> {
        let count = count_of::<T>(name, count)?;
        if count > 0 {
            refuse_pointer(name, start)?;
        }
        Ok(In { start, count, caller: PhantomData })
    }

    /// An array to write, of exactly so many.
    pub fn array_out<'a, T: Copy>(
        &'a self,
        name: &str,
        start: *mut T,
        count: u64,
    ) -> Result<Out<'a, T>, Fault> {
        let array = self.array(name, start.cast_const(), count)?;
        Ok(Out { start, count: array.count, caller: PhantomData })
    }

    /// An array to write that C may leave out by null.
    pub fn column<'a, T: Copy>(
        &'a self,
        name: &str,
        start: *mut T,
        count: u64,
    ) -> Result<Out<'a, T>, Fault> {
        let none = Out { start, count: 0, caller: PhantomData };
        if start.is_null() { Ok(none) } else { self.array_out(name, start, count) }
    }

    /// Fills a buffer of `capacity` elements with all of `items`, or with none where it is too
    /// short; their number is written in both cases. A null buffer of capacity 0 asks for it.
    pub fn fill<T: Copy>(
        &self,
        name: &str,
        (start, capacity, count): (*mut T, u64, *mut u64),
        items: impl ExactSizeIterator<Item = T>,
    ) -> Result<(), Fault> {
        let buffer = self.array_out(name, start, capacity)?;
        self.put_plain("count", count, items.len() as u64)?;
        if start.is_null() {
            return Ok(());
        }
        if buffer.count < items.len() {
            let sentence = format!(
                "{name} has room for {capacity}, needed are {}: nothing was written",
                items.len()
            );
            return Err(Fault::new(OVF_SHORT_BUFFER, sentence));
        }
        items.enumerate().for_each(|(index, item)| buffer.put(index, item));
        Ok(())
    }

    /// Writes one number or handle.
    pub fn put_plain<T: Copy>(&self, name: &str, at: *mut T, value: T) -> Result<(), Fault> {
        refuse_pointer(name, at.cast_const())?;
        // SAFETY: the caller vouches for one `T` that we may write.
        unsafe { at.write(value) };
        Ok(())
    }

    /// Looks at where one number or handle is to be written, before anything is done.
    pub fn check_plain<T>(&self, name: &str, at: *mut T) -> Result<(), Fault> {
        refuse_pointer(name, at.cast_const())
    }

    /// Three coordinates.
    pub fn triple(&self, name: &str, at: *const f64) -> Result<[f64; 3], Fault> {
        let array = self.array(name, at, 3)?;
        Ok([array.get(0), array.get(1), array.get(2)])
    }

    /// A text, which ends with a NUL.
    pub fn text<'a>(&'a self, name: &str, at: *const c_char) -> Result<&'a str, Fault> {
        refuse_pointer(name, at)?;
        // SAFETY: the caller vouches for a text that ends with a NUL and that nobody changes.
        let text = unsafe { CStr::from_ptr(at) };
        text.to_str().map_err(|error| Fault::invalid(format!("{name} is not UTF-8: {error}")))
    }

    /// A text that may be left out.
    pub fn text_if<'a>(&'a self, name: &str, at: *const c_char) -> Result<Option<&'a str>, Fault> {
        if at.is_null() { Ok(None) } else { self.text(name, at).map(Some) }
    }
}

fn refuse_pointer<T>(name: &str, at: *const T) -> Result<(), Fault> {
    let what = match at {
        _ if at.is_null() => "null".to_owned(),
        _ if !at.is_aligned() => format!("not aligned to {} bytes", align_of::<T>()),
        _ => return Ok(()),
    };
    Err(Fault::new(OVF_NULL_POINTER, format!("{name} is {what}")))
}

/// A count that memory can hold.
fn count_of<T>(name: &str, count: u64) -> Result<usize, Fault> {
    let most = isize::MAX.unsigned_abs() / size_of::<T>();
    usize::try_from(count).ok().filter(|&count| count <= most).ok_or_else(|| {
        Fault::invalid(format!("{name}: {count} elements, allowed are at most {most}"))
    })
}

/// What a panic said.
fn words(panic: Box<dyn Any + Send>) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    let words = text.unwrap_or("a panic without words").to_owned();
    // Dropping what was thrown might panic again.
    std::mem::forget(panic);
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_ends_as_a_status_with_its_words() {
        let panics = |panic: fn()| {
            // SAFETY: no pointer is used.
            unsafe {
                Caller::answer(|_| {
                    panic();
                    Ok(())
                })
            }
        };
        assert_eq!(panics(|| ()), OVF_OK);
        assert_eq!(panics(|| panic!("seven {}", 7)), OVF_PANIC);
        // SAFETY: it is never null, and ends with a NUL.
        let last = unsafe { CStr::from_ptr(crate::status::ovf_last_error()) };
        assert_eq!(last.to_str().unwrap(), "a bug of overfly: seven 7");
    }
}
