//! Words, numbers and line numbers of a text file that was handed over as bytes.
//!
//! Lines end with LF, CR LF or a lone CR. A place is a byte's index; the line is counted only when a fault is told.

use rayon::prelude::*;
use std::str::from_utf8;
use thiserror::Error;

/// Larger numbers are no length or angle, and sums of them would overflow.
const LARGEST: f64 = 1e12;
/// So many bytes of numbers are worked at a time.
const PIECE: usize = 1 << 16;
/// Powers of ten up to the eight digits that are worked at once.
const POWERS: [f64; 9] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8];

/// A file's text that is not what its format asks for.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("line {line}: {problem}")]
pub struct TextError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: String,
}

/// Walks through a text word by word.
#[derive(Debug, Clone, Copy)]
pub struct Words<'a> {
    text: &'a [u8],
    /// The next byte to read.
    pub place: usize,
}

impl<'a> Words<'a> {
    /// Begins at the start of `text`, behind a byte order mark.
    pub fn new(text: &'a [u8]) -> Self {
        Words { text, place: if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 } }
    }

    /// How many bytes are left.
    pub fn left(&self) -> usize {
        self.text.len() - self.place
    }

    /// The next byte that is not white, unread; None at the end.
    #[inline]
    pub fn peek(&mut self) -> Option<u8> {
        while let Some(byte) = self.text.get(self.place) {
            if !is_white(*byte) {
                return Some(*byte);
            }
            self.place += 1;
        }
        None
    }

    /// The next word, which ends before anything white; None at the end.
    #[inline]
    pub fn word(&mut self) -> Option<&'a [u8]> {
        self.peek()?;
        let rest = &self.text[self.place..];
        let length = rest.iter().position(|byte| is_white(*byte)).unwrap_or(rest.len());
        self.place += length;
        Some(&rest[..length])
    }

    /// The next word, which also ends before a brace or a colon; one of these alone is a word.
    pub fn token(&mut self) -> Option<&'a [u8]> {
        let start = self.place;
        let word = self.word()?;
        let length = word.iter().position(|byte| b"{}:".contains(byte)).unwrap_or(word.len()).max(1);
        debug_assert!(self.place > start);
        self.place -= word.len() - length;
        Some(&word[..length])
    }

    /// The rest of the line without white ends.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.text[self.place..];
        let length = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
        self.place += length;
        rest[..length].trim_ascii()
    }

    /// The next line that holds something besides white space and a comment, which `#` begins; None at the end.
    #[inline]
    pub fn line(&mut self) -> Option<&'a [u8]> {
        loop {
            self.peek()?;
            let line = self.rest_of_line();
            let bare = line.split(|byte| *byte == b'#').next().unwrap_or_default();
            if !bare.is_empty() {
                return Some(bare.trim_ascii_end());
            }
        }
    }

    /// Reads numbers up to the end, or to the first word that is none, which is then the next; at most `most`.
    pub fn numbers(&mut self, most: usize) -> Vec<f64> {
        let mut found = vec![0.0; most.min(self.left() / 2 + 1)];
        let (mut place, mut count) = (self.place, 0);
        for slot in &mut found {
            while place < self.text.len() && is_white(self.text[place]) {
                place += 1;
            }
            if let Some((value, length)) = plain_number(&self.text[place..]) {
                *slot = value;
                place += length;
            } else {
                self.place = place;
                let Some(Ok(value)) = self.word().map(number) else { break };
                *slot = value;
                place = self.place;
            }
            count += 1;
        }
        self.place = place;
        found.truncate(count);
        found
    }

    /// The next word as a finite number.
    pub fn number(&mut self) -> Result<f64, TextError> {
        let Some(word) = self.word() else { return Err(self.fault("the file ends where a number is due")) };
        number(word).map_err(|problem| self.fault_before(word, problem))
    }

    /// The numbers of the rest, up to the first word that is none, which is then the next. Above `most`
    /// it may stop.
    ///
    /// Pieces of one size are worked in parallel, each from its first to its last whole word.
    pub fn all_numbers(&mut self, most: usize) -> Vec<f64> {
        if rayon::current_num_threads() == 1 {
            return self.numbers(most);
        }
        let pieces: Vec<_> = (self.place..self.text.len()).step_by(PIECE).collect();
        let read = |start: &usize| {
            let stop = self.word_start((start + PIECE).min(self.text.len()));
            let mut words = Words { text: &self.text[..stop], place: self.word_start(*start) };
            (words.numbers(usize::MAX), words.peek().map(|_| words.place))
        };
        let read: Vec<_> = pieces.par_iter().map(read).collect();
        let mut found = Vec::with_capacity(read.iter().map(|(numbers, _)| numbers.len()).sum());
        for (numbers, rest) in read {
            found.extend_from_slice(&numbers);
            if let Some(place) = rest {
                self.place = place;
                return found;
            }
        }
        self.place = self.text.len();
        found
    }

    /// The first place from `place` on that is not inside a word.
    fn word_start(&self, place: usize) -> usize {
        let inside = place > self.place && !is_white(self.text[place - 1]);
        let rest = if inside { &self.text[place..] } else { &[] };
        place + rest.iter().position(|byte| is_white(*byte)).unwrap_or(rest.len())
    }

    /// The next word as a whole number that is not negative.
    pub fn whole(&mut self) -> Result<usize, TextError> {
        let Some(word) = self.word() else { return Err(self.fault("the file ends where a whole number is due")) };
        let digits = from_utf8(word).ok().filter(|text| text.bytes().all(|byte| byte.is_ascii_digit()));
        let problem = || self.fault_before(word, format!("want a whole number, got {}", quoted(word)));
        digits.and_then(|text| text.parse().ok()).ok_or_else(problem)
    }

    /// A fault at the last word before the present place.
    pub fn fault(&self, problem: impl Into<String>) -> TextError {
        let read = self.text[..self.place].trim_ascii_end();
        TextError { line: line(self.text, read.len()), problem: problem.into() }
    }

    /// A fault at `word`, the word read last.
    pub fn fault_before(&self, word: &[u8], problem: impl Into<String>) -> TextError {
        TextError { line: line(self.text, self.place - word.len().min(self.place)), problem: problem.into() }
    }
}

#[inline(always)]
fn is_white(byte: u8) -> bool {
    byte == b' ' || byte.wrapping_sub(9) < 5
}

/// A word for a message: short, with what does not print spelled out.
pub fn quoted(word: &[u8]) -> String {
    let (head, dots) = if word.len() > 24 { (&word[..24], "...") } else { (word, "") };
    format!("'{}{dots}'", head.escape_ascii())
}

/// The line, counted from 1, on which the byte at `place` stands.
fn line(text: &[u8], place: usize) -> usize {
    let before = &text[..place.min(text.len())];
    let ends = before.iter().enumerate();
    1 + ends.filter(|(at, byte)| **byte == b'\n' || (**byte == b'\r' && text.get(at + 1) != Some(&b'\n'))).count()
}

/// The word as a number, rounded as `str::parse` does; not finite ones are refused.
#[inline]
pub fn number(word: &[u8]) -> Result<f64, String> {
    if let Some((value, length)) = plain_number(word)
        && length == word.len()
    {
        return Ok(value);
    }
    let parsed = from_utf8(word).ok().and_then(|text| text.parse::<f64>().ok());
    let comma = if word.contains(&b',') { "; numbers have a decimal point and spaces between them" } else { "" };
    let value = parsed.ok_or_else(|| format!("want a number, got {}{comma}", quoted(word)))?;
    if value.abs() <= LARGEST { Ok(value) } else { Err(format!("want a number up to 1e12, got {}", quoted(word))) }
}

/// The number at the start of a text and its length, when it has at most eight digits before its point and seven behind,
/// no exponent, and what follows is white; else None. Such digits fit a double exactly: one division rounds correctly.
#[inline(always)]
fn plain_number(text: &[u8]) -> Option<(f64, usize)> {
    let start = usize::from(text.first() == Some(&b'-'));
    let (digits, behind, end) = match short_number(text, start) {
        Some(found) => found,
        None => long_number(text, start)?,
    };
    if end < text.len() && !is_white(text[end]) {
        return None;
    }
    // The sign is set without a branch: it cannot be foreseen.
    let size = (digits as i64 as f64 / POWERS[behind]).to_bits() | (start as u64) << 63;
    Some((f64::from_bits(size), end))
}

/// Digits with a point inside, eight bytes at most, worked at once: their digits as one number, how many stand behind the
/// point, and their end.
#[inline(always)]
fn short_number(text: &[u8], start: usize) -> Option<(u64, usize, usize)> {
    let values = u64::from_le_bytes(*text.get(start..)?.first_chunk()?) ^ EIGHT_ZEROS;
    let others = not_digits(values);
    let point = others.trailing_zeros() / 8;
    let end = (others & others.wrapping_sub(1)).trailing_zeros() / 8;
    if end < 2 || point > 7 || (values >> (8 * point)) as u8 != b'.' ^ b'0' {
        return None;
    }
    // The digits without the point, moved to the word's end, behind zeros.
    let before = (1 << (8 * point)) - 1;
    let digits = ((values & before) | ((values >> 8) & !before)) << (8 * (9 - end)).min(63);
    Some((joined(digits), (end - 1 - point) as usize, start + end as usize))
}

/// The same with up to eight digits before and up to seven behind a point, which need not be there.
#[inline(always)]
fn long_number(text: &[u8], start: usize) -> Option<(u64, usize, usize)> {
    let (whole, point) = digits(text, start)?;
    if text.get(point) != Some(&b'.') {
        return (point > start).then_some((whole, 0, point));
    }
    let (part, end) = digits(text, point + 1)?;
    let behind = end - point - 1;
    let is_plain = end - start > 1 && behind < 8;
    is_plain.then(|| (whole * POWERS[behind] as u64 + part, behind, end))
}

/// Eight bytes that are the digit 0.
const EIGHT_ZEROS: u64 = 0x3030_3030_3030_3030;

/// Of eight bytes that were set against `EIGHT_ZEROS`: the high bit of each that is above 9.
#[inline(always)]
fn not_digits(values: u64) -> u64 {
    (values | (values & 0x7f7f_7f7f_7f7f_7f7f).wrapping_add(0x7676_7676_7676_7676)) & 0x8080_8080_8080_8080
}

/// Up to eight digits from `place` on and where they end; None so near the text's end that there are no eight bytes.
#[inline(always)]
fn digits(text: &[u8], place: usize) -> Option<(u64, usize)> {
    let values = u64::from_le_bytes(*text.get(place..)?.first_chunk()?) ^ EIGHT_ZEROS;
    let count = not_digits(values).trailing_zeros() / 8;
    Some((joined(values.checked_shl(64 - 8 * count).unwrap_or(0)), place + count as usize))
}

/// Eight digits, one a byte, the first in the lowest, as a number: pairs, fours and eights of them are joined.
#[inline(always)]
fn joined(ones: u64) -> u64 {
    let pairs = ones.wrapping_mul(10).wrapping_add(ones >> 8) & 0x00ff_00ff_00ff_00ff;
    let fours = pairs.wrapping_mul(100).wrapping_add(pairs >> 16) & 0x0000_ffff_0000_ffff;
    fours.wrapping_mul(10_000).wrapping_add(fours >> 32) & 0xffff_ffff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_round_as_the_standard_library_rounds() {
        for word in [
            "0",
            "-0",
            ".0083333",
            "5.",
            "+1.5",
            "-12.345600",
            "900719.9254740993",
            "0.12345678901234567",
            "1e-3",
            "7.62852e-016",
            "1E4",
        ] {
            let wanted: f64 = word.parse().unwrap_or(f64::NAN);
            assert_eq!(number(word.as_bytes()).map(f64::to_bits), Ok(wanted.to_bits()), "{word}");
        }
    }

    #[test]
    fn every_count_of_digits_is_read_as_the_standard_library_reads_it() {
        for (before, behind) in (0..12).flat_map(|before| (0..12).map(move |behind| (before, behind))) {
            for sign in ["", "-", "+"] {
                let word = format!("{sign}{}.{}", &"98765432109876"[..before], &"01234567890123"[..behind]);
                let wanted = word.parse::<f64>().map(f64::to_bits).ok();
                let first = |text: &str| Words::new(text.as_bytes()).numbers(1).first().map(|value| value.to_bits());
                for text in [word.clone(), format!("{word} 9 ........"), format!("{word}\n99999999")] {
                    assert_eq!(first(&text), wanted, "{text}");
                }
                let whole = &word[..word.len() - behind - 1];
                let wanted = format!("{whole}0").parse::<f64>().map(f64::to_bits).ok();
                assert_eq!(first(&format!("{whole}0\t1.5     ")), wanted, "{whole}0");
            }
        }
    }

    #[test]
    fn pieces_give_what_one_walk_gives() {
        let text: String =
            (0..40_000).map(|index| format!("{}{}", index % 1777, [" ", "\n", "\r\n  "][index % 3])).collect();
        for (place, word) in [(0, "0"), (PIECE - 1, "x"), (PIECE, "1"), (PIECE + 1, "-"), (2 * PIECE, " "), (3, "nan ")]
        {
            let mut changed = text.clone();
            changed.replace_range(place..place + 1, word);
            let (mut pieces, mut walk) = (Words::new(changed.as_bytes()), Words::new(changed.as_bytes()));
            assert!(pieces.all_numbers(usize::MAX) == walk.numbers(usize::MAX));
            walk.peek();
            assert_eq!(pieces.word(), walk.word(), "{place}");
        }
    }

    #[test]
    fn what_is_no_finite_number_is_refused() {
        for word in
            ["nan", "inf", "-Infinity", "1e400", "1,5", "-", ".", "1.2.3", "0x10", "1.#INF", "1e", "2e12", "--1"]
        {
            assert!(number(word.as_bytes()).is_err(), "{word}");
        }
    }

    #[test]
    fn lines_end_in_every_way() {
        let text = b"a\nb\r\nc\rd\n\re";
        let lines: Vec<usize> = [0, 2, 5, 7, 10].map(|place| line(text, place)).to_vec();
        assert_eq!(lines, [1, 2, 3, 4, 6]);
    }

    #[test]
    fn lines_are_bare_of_comments() {
        let mut words = Words::new(b"# head\r\n a b # c\n\n #\rd");
        assert_eq!([words.line(), words.line(), words.line()], [Some(b"a b".as_slice()), Some(b"d"), None]);
    }

    #[test]
    fn tokens_part_at_braces_and_colons() {
        let mut words = Words::new(b"\xef\xbb\xbf Frames:3 {}} a");
        let mut found = Vec::new();
        while let Some(token) = words.token() {
            found.push(token);
        }
        assert_eq!(found, [b"Frames".as_slice(), b":", b"3", b"{", b"}", b"}", b"a"]);
    }
}
