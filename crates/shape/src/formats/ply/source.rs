//! Numbers one after the other, from text or from bytes.

use super::header::Scalar;

/// Where numbers come from. `None` stands for the end of the file, or for something that is not a number:
/// [`Source::trouble`] tells which.
pub(super) trait Source {
    /// The next number.
    fn next(&mut self, scalar: Scalar) -> Option<f64>;
    /// Passes over numbers.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Option<()>;
    /// Bytes that are left.
    fn left(&self) -> u64;
    /// The fewest bytes that `count` more numbers can take.
    fn least_bytes(&self, scalar: Scalar, count: u64) -> u64;
    /// Offset of the number that came last, in the whole file.
    fn offset(&self) -> usize;
    /// Why the last number was `None`.
    fn trouble(&self) -> String;
}

/// Numbers as bytes.
pub(super) struct Binary<'a, const BIG_ENDIAN: bool> {
    bytes: &'a [u8],
    next: usize,
    last: usize,
}

impl<'a, const BIG_ENDIAN: bool> Binary<'a, BIG_ENDIAN> {
    /// Reads from `start` on.
    pub(super) fn new(bytes: &'a [u8], start: usize) -> Self {
        Self { bytes, next: start, last: start }
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.last = self.next;
        let mut word: [u8; N] = *self.bytes.get(self.next..)?.first_chunk()?;
        self.next += N;
        if BIG_ENDIAN {
            word.reverse();
        }
        Some(word)
    }
}

impl<const BIG_ENDIAN: bool> Source for Binary<'_, BIG_ENDIAN> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Option<f64> {
        Some(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Option<()> {
        self.last = self.next;
        let bytes = usize::try_from(count).ok()?.checked_mul(scalar.bytes())?;
        let end = self.next.checked_add(bytes).filter(|end| *end <= self.bytes.len())?;
        self.next = end;
        Some(())
    }

    fn left(&self) -> u64 {
        (self.bytes.len() - self.next) as u64
    }

    fn least_bytes(&self, scalar: Scalar, count: u64) -> u64 {
        count.saturating_mul(scalar.bytes() as u64)
    }

    fn offset(&self) -> usize {
        self.last
    }

    fn trouble(&self) -> String {
        "the file ends".into()
    }
}

/// Numbers as words between blanks; lines do not matter.
pub(super) struct Ascii<'a> {
    bytes: &'a [u8],
    next: usize,
    last: usize,
}

impl<'a> Ascii<'a> {
    /// Reads from `start` on.
    pub(super) fn new(bytes: &'a [u8], start: usize) -> Self {
        Self { bytes, next: start, last: start }
    }

    fn word(&mut self) -> &'a [u8] {
        let blank = |b: &u8| b.is_ascii_whitespace();
        let rest = &self.bytes[self.next..];
        self.last = self.next + rest.iter().position(|b| !blank(b)).unwrap_or(rest.len());
        let word = &self.bytes[self.last..];
        let word = &word[..word.iter().position(blank).unwrap_or(word.len())];
        self.next = self.last + word.len();
        word
    }
}

impl Source for Ascii<'_> {
    fn next(&mut self, _: Scalar) -> Option<f64> {
        std::str::from_utf8(self.word()).ok()?.parse().ok()
    }

    fn skip(&mut self, scalar: Scalar, count: u64) -> Option<()> {
        for _ in 0..count {
            self.next(scalar)?;
        }
        Some(())
    }

    fn left(&self) -> u64 {
        (self.bytes.len() - self.next) as u64
    }

    fn least_bytes(&self, _: Scalar, count: u64) -> u64 {
        // A blank and a digit each; the first blank may be behind us.
        count.saturating_mul(2).saturating_sub(1)
    }

    fn offset(&self) -> usize {
        self.last
    }

    fn trouble(&self) -> String {
        let word = &self.bytes[self.last..self.next];
        if word.is_empty() {
            return "the file ends".into();
        }
        let shown: String = String::from_utf8_lossy(word).chars().take(30).collect();
        format!("`{}` is not a number", shown.escape_debug())
    }
}
