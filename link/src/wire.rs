//! Numbers in packets: fields at fixed offsets, in either byte order.
//!
//! In:    bytes of one packet whose length was checked; a buffer that grows by packets.
//! Out:   numbers; packets.
//! Keeps: nothing.
//! Not here: which field lies where (`cigi`, `fgfs`).

/// Which byte of a number comes first.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum ByteOrder {
    /// The most significant: network order.
    Big,
    /// The least significant: what most machines have.
    #[default]
    Little,
}

/// One packet to read from. Offsets count from its first byte; all must lie within it.
#[derive(Clone, Copy)]
pub struct Fields<'b> {
    bytes: &'b [u8],
    order: ByteOrder,
}

impl<'b> Fields<'b> {
    pub fn new(bytes: &'b [u8], order: ByteOrder) -> Self {
        Self { bytes, order }
    }

    /// The bytes of a field, the most significant first.
    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        let field = &self.bytes[at..at + N];
        let mut bytes: [u8; N] = field.try_into().expect("a slice of N bytes is N bytes");
        if self.order == ByteOrder::Little {
            bytes.reverse();
        }
        bytes
    }

    pub fn u8(&self, at: usize) -> u8 {
        self.bytes[at]
    }

    pub fn i8(&self, at: usize) -> i8 {
        i8::from_be_bytes([self.bytes[at]])
    }

    pub fn u16(&self, at: usize) -> u16 {
        u16::from_be_bytes(self.array(at))
    }

    pub fn u32(&self, at: usize) -> u32 {
        u32::from_be_bytes(self.array(at))
    }

    pub fn f32(&self, at: usize) -> f32 {
        f32::from_be_bytes(self.array(at))
    }

    pub fn f64(&self, at: usize) -> f64 {
        f64::from_be_bytes(self.array(at))
    }
}

/// One packet to write, at the end of a buffer: zeros, but for what is put into it.
pub struct Draft<'o> {
    bytes: &'o mut [u8],
    order: ByteOrder,
}

impl<'o> Draft<'o> {
    /// A packet with its identifier and size in the first two bytes, as in CIGI 3.
    pub fn new(out: &'o mut Vec<u8>, order: ByteOrder, [id, size]: [u8; 2]) -> Self {
        let begin = out.len();
        out.resize(begin + usize::from(size), 0);
        let bytes = &mut out[begin..];
        (bytes[0], bytes[1]) = (id, size);
        Self { bytes, order }
    }

    /// Puts a field, given with the most significant byte first.
    fn put<const N: usize>(&mut self, at: usize, mut bytes: [u8; N]) {
        if self.order == ByteOrder::Little {
            bytes.reverse();
        }
        self.bytes[at..at + N].copy_from_slice(&bytes);
    }

    pub fn u8(&mut self, at: usize, value: u8) {
        self.bytes[at] = value;
    }

    pub fn i8(&mut self, at: usize, value: i8) {
        self.put(at, value.to_be_bytes());
    }

    pub fn u16(&mut self, at: usize, value: u16) {
        self.put(at, value.to_be_bytes());
    }

    pub fn u32(&mut self, at: usize, value: u32) {
        self.put(at, value.to_be_bytes());
    }

    pub fn f32(&mut self, at: usize, value: f32) {
        self.put(at, value.to_be_bytes());
    }

    pub fn f64(&mut self, at: usize, value: f64) {
        self.put(at, value.to_be_bytes());
    }
}
