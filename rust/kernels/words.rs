//! Words, numbers and line numbers of a text file that was handed over as bytes.
//!
//! Lines end with LF, CR LF or a lone CR. A place is a byte's index; the line is counted only when a fault is told.

use std::str::from_utf8;
use thiserror::Error;

/// Larger numbers are no length or angle, and sums of them would overflow.
const LARGEST: f64 = 1e12;
/// Powers of ten that a double holds exactly.
const POWERS: [f64; DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
/// So many digits are a whole number that a double holds exactly.
const DIGITS: usize = 15;

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

    /// The next word as a finite number.
    #[inline]
    pub fn number(&mut self) -> Result<f64, TextError> {
        if self.peek().is_some()
            && let Some((value, length)) = plain_number(&self.text[self.place..])
        {
            self.place += length;
            return Ok(value);
        }
        let Some(word) = self.word() else { return Err(self.fault("the file ends where a number is due")) };
        number(word).map_err(|problem| self.fault_before(word, problem))
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

/// The number at the start of a text and its length, when it is no larger than allowed, has no exponent, its digits fit
/// a double exactly (one division then rounds it correctly) and what follows is white; else None.
#[inline]
fn plain_number(text: &[u8]) -> Option<(f64, usize)> {
    let start = usize::from(text.first() == Some(&b'-'));
    let (digits, point) = digits(&text[start..], 0, DIGITS)?;
    let (digits, end, behind) = if text.get(start + point) == Some(&b'.') {
        let (all, length) = self::digits(&text[start + point + 1..], digits, DIGITS - point)?;
        (all, start + point + 1 + length, length)
    } else {
        (digits, start + point, 0)
    };
    let size = digits as f64 / POWERS[behind];
    let is_plain = point + behind > 0 && size <= LARGEST && text.get(end).is_none_or(|byte| is_white(*byte));
    is_plain.then_some((if start == 1 { -size } else { size }, end))
}

/// Reads digits behind those of `value`; None when there are more than `most`.
#[inline(always)]
fn digits(text: &[u8], mut value: u64, most: usize) -> Option<(u64, usize)> {
    for (length, byte) in text.iter().enumerate() {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            return Some((value, length));
        }
        if length == most {
            return None;
        }
        value = value * 10 + u64::from(digit);
    }
    Some((value, text.len()))
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
