//! Reads the text of a BVH file: a hierarchy of joints, then one number a channel and frame.
//!
//! Numbers may be broken over lines as they like, but there must be exactly as many as the header says.

use crate::kinematics::Channel;
use crate::words::{TextError, Words, number, quoted};
use glam::DVec3;

/// A skeleton of this size in every frame is read from any file, though most of its joints had no channels.
const JOINTS_OF_SMALL_FILE: usize = 1 << 22;

/// What a BVH file says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bvh {
    /// The joints' names, as they stand in the file.
    pub names: Vec<String>,
    /// Each joint's parent, which stands before it, or -1.
    pub parents: Vec<i32>,
    /// Each joint's offset from its parent.
    pub offsets: Vec<DVec3>,
    /// How many channels each joint has.
    pub counts: Vec<usize>,
    /// The channels, joint by joint.
    pub channels: Vec<Channel>,
    /// The end sites: the joint that each ends.
    pub end_parents: Vec<i32>,
    /// The end sites' offsets from their joints.
    pub end_offsets: Vec<DVec3>,
    /// Seconds from frame to frame.
    pub frame_time: f64,
    /// How many frames there are.
    pub frames: usize,
    /// The numbers, frames x channels.
    pub values: Vec<f64>,
}

/// A joint or end site whose closing brace has not come yet.
struct Open {
    index: i32,
    is_end: bool,
    offset: bool,
    channels: bool,
}

/// Reads a whole file.
pub fn parse(text: &[u8]) -> Result<Bvh, TextError> {
    let mut words = Words::new(text);
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
        return Err(words.fault("the text is UTF-16; want ASCII or UTF-8"));
    }
    expect(&mut words, b"HIERARCHY")?;
    let mut bvh = Bvh::default();
    let mut open: Vec<Open> = Vec::new();
    loop {
        let Some(token) = words.token() else { return Err(words.fault("the file ends inside the hierarchy")) };
        match open.last_mut() {
            None if is(token, b"ROOT") => open.push(bvh.joint(&mut words, -1)?),
            None if is(token, b"MOTION") => break,
            None => return Err(unexpected(&words, token, "ROOT or MOTION")),
            Some(top) if token == b"}" => {
                if !top.offset {
                    return Err(words.fault("a joint without OFFSET"));
                }
                open.pop();
            }
            Some(top) if is(token, b"OFFSET") => bvh.offset(&mut words, top)?,
            Some(top) if is(token, b"CHANNELS") && !top.is_end => bvh.channels(&mut words, top)?,
            Some(top) if is(token, b"JOINT") && !top.is_end => {
                let parent = top.index;
                open.push(bvh.joint(&mut words, parent)?);
            }
            Some(top) if is(token, b"END") && !top.is_end => {
                let parent = top.index;
                open.push(bvh.end(&mut words, parent)?);
            }
            Some(top) if top.is_end => return Err(unexpected(&words, token, "OFFSET or }")),
            Some(_) => return Err(unexpected(&words, token, "OFFSET, CHANNELS, JOINT, End Site or }")),
        }
    }
    bvh.motion(&mut words)?;
    Ok(bvh)
}

impl Bvh {
    /// A joint up to its opening brace.
    fn joint(&mut self, words: &mut Words, parent: i32) -> Result<Open, TextError> {
        let index = self.names.len() as i32;
        let name = name(words)?;
        if name.is_empty() {
            return Err(words.fault("a joint without a name"));
        }
        expect(words, b"{")?;
        self.names.push(name);
        self.parents.push(parent);
        self.offsets.push(DVec3::ZERO);
        self.counts.push(0);
        Ok(Open { index, is_end: false, offset: false, channels: false })
    }

    /// An end site up to its opening brace; what stands behind "End" names nothing.
    fn end(&mut self, words: &mut Words, parent: i32) -> Result<Open, TextError> {
        name(words)?;
        expect(words, b"{")?;
        self.end_parents.push(parent);
        self.end_offsets.push(DVec3::ZERO);
        Ok(Open { index: self.end_parents.len() as i32 - 1, is_end: true, offset: false, channels: false })
    }

    fn offset(&mut self, words: &mut Words, top: &mut Open) -> Result<(), TextError> {
        if top.offset {
            return Err(words.fault("a second OFFSET for one joint"));
        }
        top.offset = true;
        let offset = DVec3::new(coordinate(words)?, coordinate(words)?, coordinate(words)?);
        let offsets = if top.is_end { &mut self.end_offsets } else { &mut self.offsets };
        if let Some(last) = offsets.get_mut(top.index as usize) {
            *last = offset;
        }
        Ok(())
    }

    fn channels(&mut self, words: &mut Words, top: &mut Open) -> Result<(), TextError> {
        let joint = top.index as usize;
        if top.channels || joint + 1 != self.names.len() {
            return Err(words.fault("CHANNELS must stand once, before the joint's children"));
        }
        top.channels = true;
        let first = self.channels.len();
        self.counts[joint] = words.whole()?;
        for _ in 0..self.counts[joint] {
            let word = words.token().unwrap_or_default();
            let channel =
                channel(word).ok_or_else(|| unexpected(words, word, "a channel as Xposition or Zrotation"))?;
            if matches!(channel, Channel::Position(_)) && self.channels[first..].contains(&channel) {
                return Err(words.fault(format!("the channel {} stands twice", quoted(word))));
            }
            self.channels.push(channel);
        }
        Ok(())
    }

    /// Everything behind MOTION.
    fn motion(&mut self, words: &mut Words) -> Result<(), TextError> {
        expect(words, b"Frames")?;
        skip_colon(words);
        self.frames = words.whole()?;
        let width = self.channels.len();
        if self.frames == 0 || width == 0 {
            return Err(words.fault(if width == 0 {
                "no joint has a channel"
            } else {
                "the file says it has no frames"
            }));
        }
        let wanted = self.frames.checked_mul(width).filter(|count| *count <= words.left().div_ceil(2));
        let header = words.fault(format!("more frames are announced, {}, than the file can hold", self.frames));
        expect(words, b"Frame")?;
        expect(words, b"Time")?;
        skip_colon(words);
        self.frame_time = words.number()?;
        if !(1e-5..=1e3).contains(&self.frame_time) {
            return Err(words.fault(format!("want a frame time in seconds above 0, got {}", self.frame_time)));
        }
        let joints = self.frames.saturating_mul(self.names.len());
        let Some(wanted) = wanted.filter(|_| joints <= words.left().saturating_add(JOINTS_OF_SMALL_FILE)) else {
            return Err(header);
        };
        let start = *words;
        self.values = words.all_numbers(wanted + 1);
        if words.peek().is_some() && self.values.len() < wanted {
            words.number()?;
        }
        if self.values.len() > wanted || words.peek().is_some() {
            *words = start;
            words.numbers(wanted);
            words.word();
            return Err(words.fault(format!("more numbers than {}", self.sizes())));
        }
        if self.values.len() < wanted {
            let got = self.values.len();
            return Err(words.fault(format!("the file ends after {got} numbers, want {}", self.sizes())));
        }
        Ok(())
    }

    fn sizes(&self) -> String {
        let width = self.channels.len();
        format!("{} frames of {width} channels: {}", self.frames, self.frames * width)
    }
}

/// The rest of a line up to its opening brace; a brace inside a word is part of a name.
fn name(words: &mut Words) -> Result<String, TextError> {
    let start = words.place;
    let line = words.rest_of_line();
    let brace = (0..line.len())
        .find(|at| line[*at] == b'{' && (*at == 0 || line[at - 1].is_ascii_whitespace() || at + 1 == line.len()));
    let Some(brace) = brace else { return Ok(decoded(line)) };
    words.place = start;
    words.peek();
    words.place += brace;
    Ok(decoded(line[..brace].trim_ascii_end()))
}

/// UTF-8, or else Latin-1, in which every byte is a letter.
fn decoded(name: &[u8]) -> String {
    std::str::from_utf8(name).map_or_else(|_| name.iter().map(|byte| char::from(*byte)).collect(), str::to_string)
}

fn channel(word: &[u8]) -> Option<Channel> {
    let (first, kind) = word.split_first()?;
    let axis = b"xyz".iter().position(|letter| *letter == first.to_ascii_lowercase())?;
    if is(kind, b"position") {
        return Some(Channel::Position(axis));
    }
    is(kind, b"rotation").then_some(Channel::Rotation(axis))
}

/// A number that a brace may follow without a space.
fn coordinate(words: &mut Words) -> Result<f64, TextError> {
    let token = words.token().unwrap_or_default();
    if token.is_empty() {
        return Err(unexpected(words, token, "a number"));
    }
    number(token).map_err(|problem| words.fault_before(token, problem))
}

fn is(word: &[u8], wanted: &[u8]) -> bool {
    word.eq_ignore_ascii_case(wanted)
}

fn expect(words: &mut Words, wanted: &[u8]) -> Result<(), TextError> {
    let token = words.token().unwrap_or_default();
    if is(token, wanted) { Ok(()) } else { Err(unexpected(words, token, &String::from_utf8_lossy(wanted))) }
}

fn unexpected(words: &Words, token: &[u8], wanted: &str) -> TextError {
    if token.is_empty() {
        return words.fault(format!("the file ends where {wanted} is due"));
    }
    words.fault_before(token, format!("want {wanted}, got {}", quoted(token)))
}

fn skip_colon(words: &mut Words) {
    if words.peek() == Some(b':') {
        words.place += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "HIERARCHY\nROOT a{b {\nOFFSET 0 0 0\nCHANNELS 2 Yposition Zrotation\nJOINT c\n{ OFFSET 1 .5 0\n\
        CHANNELS 1 xROTATION End Site x\n{\nOFFSET 1 0 0}}}\nMOTION\nFrames: 2\nFrame Time: .0083333\n1 2\n3 4 5\n6";

    #[test]
    fn a_small_file_is_read() {
        let bvh = parse(TWO.as_bytes()).unwrap_or_default();
        assert_eq!(bvh.names, ["a{b", "c"]);
        assert_eq!((bvh.parents, bvh.counts), (vec![-1, 0], vec![2, 1]));
        assert_eq!(bvh.channels, [Channel::Position(1), Channel::Rotation(2), Channel::Rotation(0)]);
        assert_eq!((bvh.end_parents, bvh.end_offsets), (vec![1], vec![DVec3::X]));
        assert_eq!((bvh.frames, bvh.frame_time, bvh.values.len()), (2, 0.0083333, 6));
    }

    #[test]
    fn a_count_that_is_wrong_is_refused() {
        for (from, to) in [("Frames: 2", "Frames: 1"), ("Frames: 2", "Frames: 3"), ("Frames: 2", "Frames: 1000000000")]
        {
            assert!(parse(TWO.replace(from, to).as_bytes()).is_err(), "{to}");
        }
    }

    #[test]
    fn every_cut_before_the_last_number_is_refused() {
        for length in 0..TWO.len() - 1 {
            assert!(parse(&TWO.as_bytes()[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn faults_are_told_with_their_line() {
        let lines = [("OFFSET 1 .5 0", 6), ("CHANNELS 1 xROTATION", 7), ("Frame Time: .0083333", 12), ("3 4", 14)];
        for (from, wanted) in lines {
            let got = parse(TWO.replace(from, "x 1 nan").as_bytes()).map_err(|error| error.line);
            assert_eq!(got, Err(wanted), "{from}");
        }
    }
}
