//! The frames of a GIF: colours to a palette's indices, and the indices packed by LZW (GIF89a, appendix F).
//!
//! Where frames are opaque only the rectangle that changed is kept, and what stays the same in it is transparent: long
//! runs pack well. With transparent frames the rectangle is that of the picture, laid on an empty ground.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// Values of the table from colours to indices: five bits of each of red, green and blue, red highest.
pub const TABLE: usize = 1 << 15;
/// The index that stays transparent.
pub const CLEAR: u8 = 255;
/// Least alpha of a pixel that is shown.
const OPAQUE: u8 = 128;
/// Codes have at most twelve bits.
const CODES: u16 = 4096;
/// Colours are bytes, so an index has eight bits and the first two free codes are these.
const RESET: u16 = 256;
const END: u16 = 257;

/// One frame, packed: where it lies and its data in GIF's sub-blocks, without the leading code size (always 8).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packed {
    /// Left, top, width and height in pixels.
    pub place: [usize; 4],
    /// Sub-blocks with their closing zero.
    pub data: Vec<u8>,
}

/// Packs frames of `width` x `height` RGB or straight RGBA pixels that follow each other.
///
/// `previous` holds the indices of the frame before the first: what does not change is left out, in place of what is
/// transparent, and the last frame's indices are put there. Without it frames are transparent where their alpha is low.
pub fn pack_frames(
    frames: &[u8],
    channels: usize,
    width: usize,
    height: usize,
    table: &[u8],
    previous: Option<&mut [u8]>,
) -> Result<Vec<Packed>, KernelError> {
    let size = width * height;
    check_length("table", TABLE, table.len())?;
    let whole = matches!(channels, 3 | 4) && size > 0 && frames.len().is_multiple_of(size * channels);
    if !whole || width > 65535 || height > 65535 {
        return Err(KernelError::Argument {
            argument: "frames",
            problem: "want whole frames of 1 to 65535 pixels a side",
        });
    }
    let indexed: Vec<Vec<u8>> =
        frames.par_chunks_exact(size * channels).map(|frame| indices(frame, channels, table)).collect();
    let Some(last) = previous else {
        return Ok(indexed.par_iter().map(|frame| pack(frame, None, width, height)).collect());
    };
    check_length("previous", size, last.len())?;
    let packed = (0..indexed.len()).into_par_iter().map(|at| {
        let before = if at == 0 { &*last } else { &indexed[at - 1] };
        pack(&indexed[at], Some(before), width, height)
    });
    let packed = packed.collect();
    if let Some(frame) = indexed.last() {
        last.copy_from_slice(frame);
    }
    Ok(packed)
}

/// The palette's index of every pixel.
fn indices(frame: &[u8], channels: usize, table: &[u8]) -> Vec<u8> {
    let index = |red: u8, green: u8, blue: u8| {
        table[(usize::from(red >> 3) << 10) | (usize::from(green >> 3) << 5) | usize::from(blue >> 3)]
    };
    if channels == 3 {
        return frame.as_chunks().0.iter().map(|&[red, green, blue]| index(red, green, blue)).collect();
    }
    let shown = |&[red, green, blue, alpha]: &[u8; 4]| if alpha < OPAQUE { CLEAR } else { index(red, green, blue) };
    frame.as_chunks().0.iter().map(shown).collect()
}

/// The smallest rectangle that holds what is shown, packed; one pixel where nothing is.
fn pack(frame: &[u8], before: Option<&[u8]>, width: usize, height: usize) -> Packed {
    let empty = vec![CLEAR; if before.is_some() { 0 } else { frame.len() }];
    let below = before.unwrap_or(&empty);
    let rows = |row: usize| (&frame[row * width..(row + 1) * width], &below[row * width..(row + 1) * width]);
    let differs = |row: &usize| rows(*row).0 != rows(*row).1;
    let mut packer = Packer::new();
    let Some(top) = (0..height).find(differs) else {
        packer.push(CLEAR);
        return Packed { place: [0, 0, 1, 1], data: packer.finish() };
    };
    let bottom = (top..height).rev().find(differs).map_or(top, |row| row + 1);
    let (mut left, mut right) = (width, 0);
    for (shown, under) in (top..bottom).map(rows) {
        let unlike = |&column: &usize| shown[column] != under[column];
        left = (0..left).find(unlike).unwrap_or(left);
        right = (right..width).rev().find(unlike).map_or(right, |column| column + 1);
    }
    for (shown, under) in (top..bottom).map(rows) {
        for (&index, &old) in shown[left..right].iter().zip(&under[left..right]) {
            packer.push(if index == old { CLEAR } else { index });
        }
    }
    Packed { place: [left, top, right - left, bottom - top], data: packer.finish() }
}

/// Codes of growing width, least significant bit first, in sub-blocks of at most 255 bytes.
struct Writer {
    bytes: Vec<u8>,
    /// Where the length of the sub-block that is being filled stands.
    block: usize,
    bits: u32,
    filled: u32,
}

impl Writer {
    fn put(&mut self, code: u16, width: u32) {
        self.bits |= u32::from(code) << self.filled;
        self.filled += width;
        while self.filled >= 8 {
            self.byte();
        }
    }

    fn byte(&mut self) {
        if self.bytes[self.block] == 255 {
            self.block = self.bytes.len();
            self.bytes.push(0);
        }
        self.bytes.push(self.bits as u8);
        self.bytes[self.block] += 1;
        self.bits >>= 8;
        self.filled = self.filled.saturating_sub(8);
    }

    fn finish(mut self) -> Vec<u8> {
        if self.filled > 0 {
            self.byte();
        }
        self.bytes.push(0);
        self.bytes
    }
}

const SLOTS: usize = 1 << 14;
const FREE: u32 = u32::MAX;

/// Packs indices as they come.
struct Packer {
    writer: Writer,
    /// Strings that were seen: a string's code and the index that follows it, above them the code of both. Open addressing.
    strings: Box<[u32; SLOTS]>,
    /// The code of what was pushed and not written yet.
    prefix: Option<u16>,
    next: u16,
    width: u32,
}

impl Packer {
    fn new() -> Self {
        let mut writer = Writer { bytes: vec![0], block: 0, bits: 0, filled: 0 };
        writer.put(RESET, 9);
        Self { writer, strings: Box::new([FREE; SLOTS]), prefix: None, next: END + 1, width: 9 }
    }

    #[inline(always)]
    fn push(&mut self, index: u8) {
        let Some(prefix) = self.prefix else {
            self.prefix = Some(u16::from(index));
            return;
        };
        let key = (u32::from(prefix) << 8) | u32::from(index);
        let mut slot = (key.wrapping_mul(0x9E37_79B1) >> 18) as usize % SLOTS;
        loop {
            let entry = self.strings[slot];
            if entry == FREE {
                break;
            }
            if entry & 0xF_FFFF == key {
                self.prefix = Some((entry >> 20) as u16);
                return;
            }
            slot = (slot + 1) % SLOTS;
        }
        self.add(prefix, slot, key);
        self.prefix = Some(u16::from(index));
    }

    /// Writes a known string and remembers it with the index that ended it.
    fn add(&mut self, known: u16, slot: usize, key: u32) {
        self.writer.put(known, self.width);
        if self.next < CODES {
            self.strings[slot] = (u32::from(self.next) << 20) | key;
            // The decoder is one code behind, so a width serves one code longer than it holds.
            if self.next == 1 << self.width {
                self.width += 1;
            }
            self.next += 1;
        } else {
            self.writer.put(RESET, self.width);
            self.strings.fill(FREE);
            (self.next, self.width) = (END + 1, 9);
        }
    }

    fn finish(mut self) -> Vec<u8> {
        if let Some(prefix) = self.prefix {
            self.writer.put(prefix, self.width);
            // The decoder has added an entry since: its width may have grown.
            if self.next == 1 << self.width && self.width < 12 {
                self.width += 1;
            }
        }
        self.writer.put(END, self.width);
        self.writer.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The indices of packed data, by the decoder that the format describes.
    fn expand(data: &[u8]) -> Vec<u8> {
        let (mut bytes, mut at) = (Vec::<u8>::new(), 0);
        while data[at] > 0 {
            bytes.extend(&data[at + 1..=at + data[at] as usize]);
            at += data[at] as usize + 1;
        }
        let (mut strings, mut width, mut bit, mut out): (Vec<Vec<u8>>, _, _, Vec<u8>) = (Vec::new(), 9, 0, Vec::new());
        let mut last: Option<Vec<u8>> = None;
        loop {
            let code = (0..width).fold(0usize, |code, place| {
                let from: usize = bit + place;
                code | (usize::from(bytes[from / 8] >> (from % 8) & 1) << place)
            });
            bit += width;
            if code == 256 {
                strings = (0..258).map(|value| vec![value as u8]).collect();
                (width, last) = (9, None);
                continue;
            }
            if code == 257 {
                return out;
            }
            let string = match (strings.get(code), &last) {
                (Some(known), _) => known.clone(),
                (None, Some(before)) => [before.as_slice(), &before[..1]].concat(),
                (None, None) => unreachable!(),
            };
            if let Some(before) = last {
                strings.push([before.as_slice(), &string[..1]].concat());
                if strings.len() == 1 << width && width < 12 {
                    width += 1;
                }
            }
            out.extend(&string);
            last = Some(string);
        }
    }

    fn noise(count: usize, kinds: u32) -> Vec<u8> {
        let mut state = 1u32;
        let step = |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 16) % kinds) as u8
        };
        (0..count).map(step).collect()
    }

    #[test]
    fn what_is_packed_comes_back() {
        for kinds in [1, 2, 3, 200, 255] {
            for count in [1, 2, 3, 255, 256, 3838, 3839, 3840, 5000, 60_000] {
                let indices = noise(count, kinds);
                let mut packer = Packer::new();
                indices.iter().for_each(|&index| packer.push(index));
                assert_eq!(expand(&packer.finish()), indices, "{kinds} kinds, {count}");
            }
        }
    }

    #[test]
    fn only_what_changed_is_kept() -> Result<(), KernelError> {
        let table: Vec<u8> = (0..TABLE).map(|entry| (entry >> 10) as u8).collect();
        let mut frames = [[0, 0, 0, 255]; 2 * 12];
        frames[12 + 5] = [255, 0, 0, 255];
        frames[12 + 7] = [255, 0, 0, 255];
        let mut previous = vec![0; 12];
        let packed = pack_frames(frames.as_flattened(), 4, 4, 3, &table, Some(&mut previous))?;
        assert_eq!(packed[0].place, [0, 0, 1, 1]);
        assert_eq!(packed[1].place, [1, 1, 3, 1]);
        assert_eq!(expand(&packed[1].data), [31, CLEAR, 31]);
        assert_eq!(previous, [0, 0, 0, 0, 0, 31, 0, 31, 0, 0, 0, 0]);
        Ok(())
    }

    #[test]
    fn low_alpha_is_left_out() -> Result<(), KernelError> {
        let table = vec![7; TABLE];
        let mut frame = [[9, 9, 9, 127]; 6];
        frame[4][3] = 128;
        let packed = pack_frames(frame.as_flattened(), 4, 3, 2, &table, None)?;
        assert_eq!((packed[0].place, expand(&packed[0].data)), ([1, 1, 1, 1], vec![7]));
        Ok(())
    }
}
