//! CDR, the encoding of messages of ROS 2: little-endian, each number at a multiple of its
//! size from the end of the head.

/// The head of a message: plain CDR, little-endian.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// Writes the fields of one message, in their order.
#[derive(Debug)]
pub(super) struct Encoder<'a> {
    out: &'a mut Vec<u8>,
    origin: usize,
}

impl<'a> Encoder<'a> {
    /// Begins a message at the end of `out`.
    pub(super) fn new(out: &'a mut Vec<u8>) -> Self {
        out.extend_from_slice(&HEAD);
        let origin = out.len();
        Self { out, origin }
    }

    fn align(&mut self, size: usize) {
        let over = (self.out.len() - self.origin) % size;
        if over > 0 {
            self.out.resize(self.out.len() + size - over, 0);
        }
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.out.push(value);
    }

    pub(super) fn bool(&mut self, value: bool) {
        self.u8(u8::from(value));
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.align(4);
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn u64(&mut self, value: u64) {
        self.align(8);
        self.out.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn f64(&mut self, value: f64) {
        self.u64(value.to_bits());
    }

    /// An array of fixed length.
    pub(super) fn f64s<const N: usize>(&mut self, values: [f64; N]) {
        for value in values {
            self.f64(value);
        }
    }

    pub(super) fn string(&mut self, text: &str) {
        // A zero ends the text, so none may stand in it.
        let text = text.split('\0').next().unwrap_or_default();
        self.count(text.len() + 1);
        self.out.extend_from_slice(text.as_bytes());
        self.out.push(0);
    }

    pub(super) fn strings(&mut self, texts: &[String]) {
        self.count(texts.len());
        for text in texts {
            self.string(text);
        }
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.count(bytes.len());
        self.out.extend_from_slice(bytes);
    }

    pub(super) fn floats(&mut self, values: &[f32]) {
        self.count(values.len());
        for value in values {
            self.out.extend_from_slice(&value.to_bits().to_le_bytes());
        }
    }

    pub(super) fn doubles(&mut self, values: &[f64]) {
        self.count(values.len());
        if !values.is_empty() {
            self.align(8);
        }
        for value in values {
            self.out.extend_from_slice(&value.to_bits().to_le_bytes());
        }
    }

    /// The number of the members of a sequence, which follow.
    pub(super) fn count(&mut self, members: usize) {
        self.u32(u32::try_from(members).unwrap_or(u32::MAX));
    }

    /// A time of UTC, ns.
    pub(super) fn time(&mut self, nanoseconds: u64) {
        self.u32((nanoseconds / 1_000_000_000) as u32);
        self.u32((nanoseconds % 1_000_000_000) as u32);
    }
}

/// Reads the fields of one message, in their order; `None` for one that is not whole.
#[derive(Debug)]
pub(super) struct Decoder<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Decoder<'a> {
    /// Reads the head of a message.
    pub(super) fn new(message: &'a [u8]) -> Option<Self> {
        let bytes = message.strip_prefix(&HEAD)?;
        Some(Self { bytes, at: 0 })
    }

    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(length)?;
        let taken = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    /// True if nothing is left: a field that earlier versions did not write is missing.
    pub(super) fn is_at_end(&self) -> bool {
        self.at == self.bytes.len()
    }

    fn aligned(&mut self, size: usize) -> Option<&'a [u8]> {
        self.at = self.at.checked_next_multiple_of(size)?;
        self.take(size)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        Some(self.take(1)?[0])
    }

    pub(super) fn bool(&mut self) -> Option<bool> {
        Some(self.u8()? != 0)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        let bytes = self.aligned(4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        let bytes = self.aligned(8)?;
        Some(u64::from_le_bytes(bytes.try_into().ok()?))
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits)
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }

    pub(super) fn string(&mut self) -> Option<String> {
        let length = self.count(1)?;
        let text = self.take(length)?.strip_suffix(&[0])?;
        String::from_utf8(text.to_vec()).ok()
    }

    pub(super) fn strings(&mut self) -> Option<Vec<String>> {
        // A text takes five bytes at least.
        let members = self.count(5)?;
        (0..members).map(|_| self.string()).collect()
    }

    pub(super) fn bytes(&mut self) -> Option<Vec<u8>> {
        let length = self.count(1)?;
        self.take(length).map(<[u8]>::to_vec)
    }

    pub(super) fn floats(&mut self) -> Option<Vec<f32>> {
        let members = self.count(4)?;
        let (fours, _) = self.take(4 * members)?.as_chunks::<4>();
        Some(fours.iter().map(|four| f32::from_le_bytes(*four)).collect())
    }

    pub(super) fn doubles(&mut self) -> Option<Vec<f64>> {
        let members = self.count(8)?;
        if members > 0 {
            self.at = self.at.checked_next_multiple_of(8)?;
        }
        let (eights, _) = self.take(8 * members)?.as_chunks::<8>();
        let values = eights.iter().map(|eight| f64::from_le_bytes(*eight));
        Some(values.collect())
    }

    /// The number of members of a sequence, each of `least` bytes or more: no more than there
    /// are bytes.
    pub(super) fn count(&mut self, least: usize) -> Option<usize> {
        let members = usize::try_from(self.u32()?).ok()?;
        (members <= (self.bytes.len() - self.at.min(self.bytes.len())) / least).then_some(members)
    }

    /// A time of UTC, ns.
    pub(super) fn time(&mut self) -> Option<u64> {
        let (seconds, rest) = (self.u32()?, self.u32()?);
        Some(u64::from(seconds) * 1_000_000_000 + u64::from(rest))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size() {
        let mut out = vec![9; 3];
        let mut encoder = Encoder::new(&mut out);
        encoder.u8(1);
        encoder.u32(2);
        encoder.string("ab");
        encoder.doubles(&[0.5]);
        let expected = [
            &[9, 9, 9, 0, 1, 0, 0][..],
            &[1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0],
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &0.5_f64.to_le_bytes(),
        ];
        // The string ends at 15, the count stands at 16 and the double at 24.
        assert_eq!(out, expected.concat()[..]);
        let mut decoder = Decoder::new(&out[3..]).unwrap();
        assert_eq!(decoder.u8(), Some(1));
        assert_eq!(decoder.u32(), Some(2));
        assert_eq!(decoder.string().as_deref(), Some("ab"));
        assert_eq!(decoder.doubles(), Some(vec![0.5]));
        assert_eq!(decoder.u8(), None);
    }

    #[test]
    fn a_length_beyond_the_message_is_refused() {
        let bytes = [&HEAD[..], &u32::MAX.to_le_bytes(), &[0; 12]].concat();
        assert_eq!(Decoder::new(&bytes).unwrap().doubles(), None);
        assert_eq!(Decoder::new(&bytes).unwrap().floats(), None);
        assert_eq!(Decoder::new(&bytes).unwrap().string(), None);
        assert_eq!(Decoder::new(&bytes).unwrap().strings(), None);
        assert_eq!(Decoder::new(&bytes).unwrap().bytes(), None);
    }
}
