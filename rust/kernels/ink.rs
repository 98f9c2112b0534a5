//! Ink lines on a band: outlines where a nearer surface ends before a farther one, and creases where a surface folds.
//!
//! A line belongs to the nearer surface. An outline grows from its last samples out over what is farther, with their depth
//! and object; a crease lies on its surface, half to either side, with the surface's own depth, and so does the line where
//! two surfaces cut each other. Neither covers anything nearer. Where several lines meet the nearest stays, of equals the upper left one.

use crate::band::{Band, LANES};
use crate::error::KernelError;
use crate::surface::{Scene, Surface};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Widest line in samples.
const WIDEST: f32 = 256.0;

/// Objects of these ids draw no lines of their own: particles, and shadows on the ground. Lines of others go over them.
pub const BARE: RangeInclusive<u16> = 0xFF00..=0xFFFE;

/// How lines are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    /// In samples, 0 for no lines.
    pub width: f32,
    /// Straight RGBA, laid over what is there.
    pub color: [f32; 4],
    /// Least angle between neighbouring faces' normals that makes a crease, in radians; above pi there are none.
    pub crease_angle: f32,
    /// Least difference of depth, as a part of the depth, that ends a surface of the same object.
    pub depth_jump: f32,
}

impl Ink {
    /// Refuses widths and factors that draw no line.
    pub fn check(&self) -> Result<(), KernelError> {
        let problem = if !(0.0..=WIDEST).contains(&self.width) {
            "want a width of 0 to 256 samples"
        } else if !(self.crease_angle >= 0.0 && self.depth_jump >= 0.0) {
            "want an angle and a jump of zero or more"
        } else if !self.color.iter().all(|value| value.is_finite()) {
            "want a finite color"
        } else {
            return Ok(());
        };
        Err(KernelError::Argument { argument: "ink", problem })
    }

    /// How far outside of the picture a line that reaches into it may start.
    pub fn margin(&self) -> usize {
        if self.width > 0.0 { (self.width + 0.5).floor() as usize + 1 } else { 0 }
    }
}

/// Why a sample draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Stroke {
    Outline,
    CreaseNearer,
    CreaseFarther,
}

/// What of a surface tells whether its neighbour goes on: small, since every pair of neighbours asks.
#[derive(Clone, Copy)]
pub struct Facet {
    /// Unit normal by the winding.
    normal: Vec3,
    object: u16,
    /// Whether the camera sees the side of that normal.
    is_front: bool,
}

impl Facet {
    /// Cosine of the fold towards a neighbour. Where one shows its front and the other its back, either a smooth
    /// surface turns away from the camera or the windings disagree: the smaller angle is the fold.
    fn cosine(&self, other: &Facet) -> f32 {
        let cosine = self.normal.dot(other.normal);
        if self.is_front == other.is_front { cosine } else { cosine.abs() }
    }
}

/// The surfaces' facets.
pub fn facets(scene: &Scene<'_>, surfaces: &[Surface]) -> Vec<Facet> {
    let facet = |s: &Surface| {
        let normal = scene.face_normal(s.triangle).normalize_or_zero().as_vec3();
        Facet { normal, object: s.object, is_front: s.facing > 0.0 }
    };
    surfaces.par_iter().map(facet).collect()
}

/// Finds and draws the lines of one band after another.
pub struct Pen<'a> {
    surfaces: &'a [Surface],
    facets: &'a [Facet],
    least_cosine: f32,
    greatest_ratio: f32,
    stamps: [Vec<[i32; 2]>; 3],
}

impl<'a> Pen<'a> {
    /// A pen for surfaces and their facets.
    pub fn new(ink: &Ink, surfaces: &'a [Surface], facets: &'a [Facet]) -> Self {
        // A sample's centre lies half a sample from the rim that it draws.
        let on_surface = ink.width * 0.5 - 0.5;
        let stamps = [
            stamp(|distance| distance <= ink.width + 0.5, ink.margin() as i32),
            stamp(|distance| distance <= on_surface.max(0.0), ink.margin() as i32),
            stamp(|distance| distance < on_surface, ink.margin() as i32),
        ];
        let least_cosine = if ink.crease_angle > std::f32::consts::PI { -2.0 } else { ink.crease_angle.cos() };
        Pen { surfaces, facets, least_cosine, greatest_ratio: 1.0 + ink.depth_jump, stamps }
    }

    /// Fills `owners`: for every sample of the band the sample that draws on it and one, or 0.
    pub fn draw(&self, band: &Band, owners: &mut Vec<u32>) {
        owners.clear();
        owners.resize(band.width * band.rows, 0);
        let mut strokes = self.strokes(band);
        strokes.sort_unstable();
        strokes.dedup();
        for (sample, stroke) in strokes {
            self.stamp(band, sample, stroke, owners);
        }
    }

    /// The samples that draw. No line from the last row or column held reaches the picture: the last row is left out,
    /// and the last column may look at the next row's first.
    fn strokes(&self, band: &Band) -> Vec<(u32, Stroke)> {
        let mut found = Vec::new();
        for row in 1..band.rows {
            let start = (row - 1) * band.width;
            self.compare(band, start, 1, &mut found);
            self.compare(band, start, band.width, &mut found);
        }
        found
    }

    /// Looks at a row's samples and those `offset` further on, a group at a time since most groups are alike.
    fn compare(&self, band: &Band, start: usize, offset: usize, found: &mut Vec<(u32, Stroke)>) {
        let groups = |from: usize| band.surface[from..from + band.width].as_chunks::<LANES>().0;
        for (group, (here, there)) in groups(start).iter().zip(groups(start + offset)).enumerate() {
            if here != there {
                for lane in (0..LANES).filter(|&lane| here[lane] != there[lane]) {
                    let sample = start + group * LANES + lane;
                    self.pair(band, sample, sample + offset, found);
                }
            }
        }
    }

    /// What two neighbours of different surfaces draw; of equally near ones the first counts as the nearer.
    fn pair(&self, band: &Band, first: usize, second: usize, found: &mut Vec<(u32, Stroke)>) {
        if self.goes_on_between(band, first, second) {
            return;
        }
        let swap = band.reciprocal[second] > band.reciprocal[first];
        let (nearer, farther) = if swap { (second, first) } else { (first, second) };
        let bare = |at| self.surface(band, at).is_some_and(|surface| BARE.contains(&surface.object));
        if bare(nearer) {
            return;
        }
        let ends = self.ends_between(band, nearer, farther);
        if ends && !self.dives_between(band, nearer, farther) {
            found.push((nearer as u32, Stroke::Outline));
        } else if (ends && !bare(farther)) || self.folds_between(band, nearer, farther) {
            found.push((nearer as u32, Stroke::CreaseNearer));
            found.push((farther as u32, Stroke::CreaseFarther));
        }
    }

    /// Whether two samples lie on surfaces that do not go on from one to the other.
    fn ends_between(&self, band: &Band, first: usize, second: usize) -> bool {
        let (Some(a), Some(b)) = (self.surface(band, first), self.surface(band, second)) else {
            return true;
        };
        if a.object != b.object {
            return true;
        }
        let [here, there] = [first, second].map(|sample| f64::from(band.reciprocal[sample]));
        let ratio = f64::from(self.greatest_ratio);
        if a.triangle == b.triangle || here.max(there) <= here.min(there) * ratio {
            return false;
        }
        // A steep surface goes on where either triangle's plane, continued, meets the other sample.
        let meets = |surface: &Surface, sample: usize, reciprocal: f64| {
            let [x, y] = band.place_of(sample);
            (surface.reciprocal(x, y).0 - reciprocal).abs() <= (ratio - 1.0) * reciprocal
        };
        !meets(a, second, there) && !meets(b, first, here)
    }

    /// Whether the nearer sample's plane, continued, lies behind the farther sample: the surfaces cut each other.
    fn dives_between(&self, band: &Band, nearer: usize, farther: usize) -> bool {
        let (Some(surface), [x, y]) = (self.surface(band, nearer), band.place_of(farther)) else { return false };
        band.surface[farther] > 0 && surface.reciprocal(x, y).0 < f64::from(band.reciprocal[farther])
    }

    /// Whether two neighbours surely draw nothing; most pairs are told by this alone.
    fn goes_on_between(&self, band: &Band, first: usize, second: usize) -> bool {
        let facet = |sample: usize| self.facets.get((band.surface[sample] as usize).wrapping_sub(1));
        let (Some(a), Some(b)) = (facet(first), facet(second)) else { return false };
        let [here, there] = [first, second].map(|sample| band.reciprocal[sample]);
        a.object == b.object
            && a.cosine(b) > self.least_cosine
            && here <= there * self.greatest_ratio
            && there <= here * self.greatest_ratio
    }

    fn folds_between(&self, band: &Band, first: usize, second: usize) -> bool {
        let facet = |sample: usize| self.facets.get((band.surface[sample] as usize).wrapping_sub(1));
        let (Some(a), Some(b)) = (facet(first), facet(second)) else { return false };
        a.cosine(b) <= self.least_cosine
    }

    fn surface(&self, band: &Band, sample: usize) -> Option<&Surface> {
        self.surfaces.get((band.surface[sample] as usize).wrapping_sub(1))
    }

    fn stamp(&self, band: &Band, sample: u32, stroke: Stroke, owners: &mut [u32]) {
        let source = sample as usize;
        let (row, column) = ((source / band.width) as i32, (source % band.width) as i32);
        for [down, right] in &self.stamps[stroke as usize] {
            let (row, column) = (row + down, column + right);
            if !(0..band.rows as i32).contains(&row) || !(0..band.width as i32).contains(&column) {
                continue;
            }
            let target = row as usize * band.width + column as usize;
            if band.reciprocal[target] > band.reciprocal[source] && stroke == Stroke::Outline {
                continue;
            }
            if self.ends_between(band, source, target) != (stroke == Stroke::Outline) {
                continue;
            }
            let owner = if stroke == Stroke::Outline { source } else { target };
            let held = (owners[target] as usize).checked_sub(1).map_or(0.0, |o| band.reciprocal[o]);
            if band.reciprocal[owner] > held {
                owners[target] = owner as u32 + 1;
            }
        }
    }
}

/// The steps (down, right) whose length is within reach.
fn stamp(reaches: impl Fn(f32) -> bool, most: i32) -> Vec<[i32; 2]> {
    let steps = (-most..=most).flat_map(|down| (-most..=most).map(move |right| [down, right]));
    steps.filter(|[down, right]| reaches(((down * down + right * right) as f32).sqrt())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_margin_holds_the_line_and_the_sample_that_draws_it() {
        let ink = |width| Ink { width, color: [0.0; 4], crease_angle: 1.0, depth_jump: 0.0 };
        assert_eq!([0.0, 0.2, 1.0, 3.5].map(|width| ink(width).margin()), [0, 1, 2, 5]);
    }

    #[test]
    fn a_crease_is_as_wide_as_asked_from_both_sides() {
        for width in 1..6_u8 {
            let ink = Ink { width: f32::from(width), color: [0.0; 4], crease_angle: 1.0, depth_jump: 0.0 };
            let pen = Pen::new(&ink, &[], &[]);
            let depth_of =
                |stroke: Stroke| pen.stamps[stroke as usize].iter().filter(|s| s[0] == 0 && s[1] >= 0).count();
            let thickness = depth_of(Stroke::CreaseNearer) + depth_of(Stroke::CreaseFarther);
            assert_eq!(thickness, usize::from(width));
            assert_eq!(depth_of(Stroke::Outline), usize::from(width) + 1, "its own sample counts but is not drawn");
        }
    }
}
