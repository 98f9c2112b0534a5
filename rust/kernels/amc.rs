//! Reads the text of an AMC file, Acclaim's motion: frame by frame a line with its number, then one line a bone.
//!
//! Nothing announces how many frames there are, so each frame must be whole and their numbers must run evenly. Where the
//! last line has no end, a last number with fewer decimals than in the frame before is taken for cut.

use crate::words::{TextError, Words, number, quoted};

/// What an AMC file says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Amc {
    /// The lines that begin with a colon, lower case, in their order.
    pub keywords: Vec<String>,
    /// The first frame's number.
    pub first: usize,
    /// From each frame's number to the next one's; 1 for a single frame.
    pub step: usize,
    /// How many frames there are.
    pub frames: usize,
    /// The numbers, frames x all bones' numbers in the order of the bones.
    pub values: Vec<f64>,
}

/// A bone's name and where its numbers stand in a frame.
struct Bone<'a> {
    name: &'a str,
    start: usize,
    count: usize,
}

/// Reads a whole file for the bones of a skeleton: name and how many numbers each has in a frame.
pub fn parse(text: &[u8], bones: &[(String, usize)]) -> Result<Amc, TextError> {
    let mut words = Words::new(text);
    let (mut amc, mut reader) = (Amc::default(), Reader::new(bones));
    while let Some(line) = words.line() {
        let told = if line.starts_with(b":") && amc.frames == 0 {
            amc.keywords.push(String::from_utf8_lossy(line).to_lowercase());
            Ok(())
        } else if line.iter().all(u8::is_ascii_digit) {
            reader.check_whole().and_then(|()| reader.begin(&mut amc, line))
        } else if amc.frames == 0 {
            Err(format!("want a keyword or the first frame's number, got {}", quoted(line)))
        } else {
            reader.bone(&mut amc.values, line)
        };
        told.map_err(|problem| words.fault(problem))?;
    }
    if amc.frames == 0 {
        return Err(words.fault("the file ends before its first frame"));
    }
    reader.check_whole().map_err(|problem| words.fault(problem))?;
    let has_half_an_end = text.ends_with(b"\r") && text.windows(2).any(|pair| pair == b"\r\n");
    if has_half_an_end || (!text.ends_with(b"\n") && !text.ends_with(b"\r") && reader.decimals < reader.decimals_before)
    {
        return Err(words.fault("the file seems to be cut short here; if it is whole, end its last line"));
    }
    Ok(amc)
}

/// How many digits stand behind the point of the last number of a line.
fn decimals(line: &[u8]) -> usize {
    let end = line.iter().rev().position(|byte| *byte == b'.' || byte.is_ascii_whitespace());
    end.filter(|length| line[line.len() - length - 1] == b'.').unwrap_or(0)
}

struct Reader<'a> {
    bones: Vec<Bone<'a>>,
    seen: Vec<bool>,
    width: usize,
    /// The bone whose line is expected: files keep one order.
    next: usize,
    number: usize,
    /// Decimals of each bone's last number in the latest line of it.
    tails: Vec<usize>,
    /// Decimals at the end of the latest line, and of that bone's line before.
    decimals: usize,
    decimals_before: usize,
}

impl<'a> Reader<'a> {
    fn new(bones: &'a [(String, usize)]) -> Self {
        let mut width = 0;
        let place = |(name, count): &'a (String, usize)| {
            let bone = Bone { name, start: width, count: *count };
            width += count;
            bone
        };
        let bones: Vec<_> = bones.iter().map(place).collect();
        let (seen, tails) = (vec![true; bones.len()], vec![0; bones.len()]);
        Reader { bones, seen, width, next: 0, number: 0, tails, decimals: 0, decimals_before: 0 }
    }

    /// Begins a frame with its number.
    fn begin(&mut self, amc: &mut Amc, line: &[u8]) -> Result<(), String> {
        let digits = std::str::from_utf8(line).unwrap_or_default();
        let got: usize = digits.parse().map_err(|_| format!("the frame number {} is too large", quoted(line)))?;
        match amc.frames {
            0 => (amc.first, amc.step) = (got, 1),
            1 if got > amc.first => amc.step = got - amc.first,
            _ if self.number.checked_add(amc.step) == Some(got) => {}
            _ => return Err(format!("frame {got} follows frame {}, want {}", self.number, self.number + amc.step)),
        }
        self.number = got;
        self.next = 0;
        for (seen, bone) in self.seen.iter_mut().zip(&self.bones) {
            *seen = bone.count == 0;
        }
        amc.frames += 1;
        amc.values.resize(amc.frames * self.width, 0.0);
        Ok(())
    }

    /// One bone's line: its name, then as many numbers as its skeleton gives it.
    fn bone(&mut self, values: &mut [f64], line: &[u8]) -> Result<(), String> {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let name = words.next().unwrap_or_default();
        let is_named = |bone: &Bone| bone.name.as_bytes().eq_ignore_ascii_case(name);
        let expected = self.bones.get(self.next).is_some_and(is_named).then_some(self.next);
        let Some(index) = expected.or_else(|| self.bones.iter().position(is_named)) else {
            return Err(format!("the skeleton has no bone {}", quoted(name)));
        };
        let bone = &self.bones[index];
        if self.seen[index] && bone.count > 0 {
            return Err(format!("the bone {} stands twice in frame {}", quoted(name), self.number));
        }
        let start = values.len() - self.width + bone.start;
        let mut got = 0;
        for word in words {
            let value = number(word)?;
            if got < bone.count {
                values[start + got] = value;
            }
            got += 1;
        }
        if got != bone.count {
            return Err(format!("the bone {} has {got} numbers, the skeleton says {}", quoted(name), bone.count));
        }
        self.seen[index] = true;
        self.next = index + 1;
        self.decimals = decimals(line);
        self.decimals_before = std::mem::replace(&mut self.tails[index], self.decimals);
        Ok(())
    }

    /// Refuses a frame that lacks a bone.
    fn check_whole(&self) -> Result<(), String> {
        match self.seen.iter().position(|seen| !seen) {
            Some(index) => Err(format!("frame {} lacks the bone '{}'", self.number, self.bones[index].name)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Amc, TextError> {
        parse(text.as_bytes(), &[("root".to_string(), 2), ("still".to_string(), 0), ("leg".to_string(), 1)])
    }

    #[test]
    fn bones_may_stand_in_any_order() {
        let amc = read("# a\n:FULLY-SPECIFIED\n:degrees\n5\nleg 3 # b\nROOT 1 2\n6\nroot 4 5\nstill\nleg 6\n")
            .unwrap_or_default();
        assert_eq!(amc.keywords, [":fully-specified", ":degrees"]);
        assert_eq!((amc.first, amc.step, amc.frames), (5, 1, 2));
        assert_eq!(amc.values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn what_is_missing_or_too_much_is_told_with_its_line() {
        let frame = |number: &str| format!("{number}\nroot 1 2\nleg 3\n");
        for (text, line) in [
            (String::new(), 1),
            ("1\nroot 1 2\n".to_string(), 2),
            ("1\nroot 1 2\n2\n".to_string(), 3),
            (frame("1") + "leg 4\n", 4),
            (frame("1") + &frame("1"), 4),
            (frame("1") + &frame("2") + &frame("4"), 7),
            ("1\nroot 1 2 3\nleg 3\n".to_string(), 2),
            ("1\nroot 1\nleg 3\n".to_string(), 2),
            ("1\nroot 1 nan\nleg 3\n".to_string(), 2),
            ("1\narm 1\nleg 3\n".to_string(), 2),
            ("root 1 2\n".to_string(), 1),
        ] {
            assert_eq!(read(&text).map_err(|error| error.line), Err(line), "{text}");
        }
    }

    #[test]
    fn a_last_number_that_is_shorter_than_usual_is_taken_for_cut() {
        let start = "1\nroot 1 2\nleg 3.25\n2\nroot 1 2\nleg ";
        for (end, is_read) in [("3.5\n", true), ("3.25", true), ("3.5", false), ("3", false), ("3.25\r", true)] {
            assert_eq!(read(&format!("{start}{end}")).is_ok(), is_read, "{end:?}");
        }
        let crlf = format!("{start}3.25\r\n").replace('\n', "\r\n").replace("\r\r", "\r");
        assert!(read(&crlf).is_ok() && read(crlf.trim_end_matches('\n')).is_err());
    }

    #[test]
    fn every_second_frame_is_a_motion_too() {
        let frames: String = ["2", "4", "6"].iter().map(|number| format!("{number}\nroot 1 2\nleg 3\n")).collect();
        assert_eq!(read(&frames).map(|amc| (amc.first, amc.step, amc.frames)), Ok((2, 2, 3)));
    }
}
