//! Antialiased polygons and pens of varying width into a premultiplied RGBA picture.
//!
//! Coverage is tiny-skia's (nonzero winding, 4 x 16 subsamples a pixel; without antialiasing a pixel is in when its
//! centre is). Points are (x, y) with pixel centres at integers; tiny-skia has them at halves, so points move by 0.5.
//! A pen of varying width is the union of the convex hulls of neighbouring discs, all wound the same way, filled once:
//! a translucent stroke never darkens where it overlaps itself.

use crate::error::{KernelError, check_length};
use glam::DVec2;
use std::f64::consts::{PI, TAU};
use tiny_skia::{Color, FillRule, Paint, Path, PathBuilder, PixmapMut, Transform};

/// How far a polygon that stands for a disc may stay inside it, in pixels: a twentieth of the finest coverage step.
const FLATNESS: f64 = 0.0125;

/// Farthest coordinate that is taken: beyond it tiny-skia's 16.16 fixed point no longer holds a pixel's fractions.
const REACH: f64 = 16_000.0;

/// A picture to paint on: row-major premultiplied RGBA.
#[derive(Debug)]
pub struct Picture<'a> {
    /// Four bytes a pixel.
    pub pixels: &'a mut [u8],
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// What is put on the picture and how.
#[derive(Debug, Clone, Copy)]
pub struct Ink {
    /// Straight RGBA.
    pub color: [u8; 4],
    /// Soft rims, or each pixel wholly in or out.
    pub antialias: bool,
}

/// Fills a closed polygon; where it covers itself it is filled once.
pub fn fill_polygon(picture: &mut Picture<'_>, points: &[DVec2], ink: Ink) -> Result<(), KernelError> {
    check_points(points)?;
    let mut path = PathBuilder::new();
    push_ring(&mut path, points.iter().copied());
    fill(picture, path.finish(), ink)
}

/// Draws a pen along `points` with round ends and joins; `widths` holds the pen's width at each point.
///
/// One point gives a disc. With `closed` the pen returns to the first point.
pub fn stroke_polyline(
    picture: &mut Picture<'_>,
    points: &[DVec2],
    widths: &[f64],
    closed: bool,
    ink: Ink,
) -> Result<(), KernelError> {
    check_points(points)?;
    check_length("width", points.len(), widths.len())?;
    if let Some(index) = widths.iter().position(|w| !(0.0..=REACH).contains(w)) {
        return Err(KernelError::Item { argument: "width", problem: "want 0 to 16000 pixels", index });
    }
    let mut path = PathBuilder::new();
    let discs: Vec<(DVec2, f64)> = points.iter().copied().zip(widths.iter().map(|w| w / 2.0)).collect();
    for pair in discs.windows(2) {
        push_hull(&mut path, pair[0], pair[1]);
    }
    if let ([first, .., last], true) = (discs.as_slice(), closed) {
        push_hull(&mut path, *last, *first);
    } else if let [only] = discs.as_slice() {
        push_hull(&mut path, *only, *only);
    }
    fill(picture, path.finish(), ink)
}

/// Writes the picture with straight alpha; where alpha is 0 the colour is 0.
pub fn unpremultiply(pixels: &[u8], out: &mut [u8]) -> Result<(), KernelError> {
    check_length("out", pixels.len(), out.len())?;
    for (from, to) in pixels.as_chunks::<4>().0.iter().zip(out.as_chunks_mut::<4>().0) {
        let alpha = u32::from(from[3]);
        *to = match alpha {
            0 => [0; 4],
            255 => *from,
            _ => from.map(|value| ((u32::from(value) * 255 + alpha / 2) / alpha).min(255) as u8),
        };
        to[3] = from[3];
    }
    Ok(())
}

fn check_points(points: &[DVec2]) -> Result<(), KernelError> {
    // A NaN fails the comparison, so it is found as well.
    match points.iter().position(|p| !(p.x.abs() <= REACH && p.y.abs() <= REACH)) {
        Some(index) => Err(KernelError::Item {
            argument: "points",
            problem: "want finite coordinates within 16000 pixels of the origin",
            index,
        }),
        None => Ok(()),
    }
}

fn push_ring(path: &mut PathBuilder, points: impl Iterator<Item = DVec2>) {
    for (index, point) in points.enumerate() {
        let (x, y) = ((point.x + 0.5) as f32, (point.y + 0.5) as f32);
        if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    path.close();
}

/// The convex hull of two discs as one ring, always turning the same way.
fn push_hull(path: &mut PathBuilder, a: (DVec2, f64), b: (DVec2, f64)) {
    let (big, small) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let axis = small.0 - big.0;
    let distance = axis.length();
    if distance <= big.1 - small.1 {
        let ring = arc(big, 0.0, TAU);
        return push_ring(path, ring);
    }
    let (heading, spread) = (axis.y.atan2(axis.x), ((big.1 - small.1) / distance).acos());
    let around_big = arc(big, heading + spread, TAU - 2.0 * spread);
    push_ring(path, around_big.chain(arc(small, heading - spread, 2.0 * spread)));
}

/// Points on a disc's rim from `start` over `sweep` radians, dense enough for `FLATNESS`.
fn arc((center, radius): (DVec2, f64), start: f64, sweep: f64) -> impl Iterator<Item = DVec2> {
    let step = 2.0 * (1.0 - FLATNESS / radius.max(FLATNESS)).clamp(-1.0, 1.0).acos();
    let count = (sweep / step.clamp(1e-3, PI / 4.0)).ceil().max(1.0) as usize;
    (0..=count).map(move |i| center + radius * DVec2::from_angle(start + sweep * i as f64 / count as f64))
}

fn fill(picture: &mut Picture<'_>, path: Option<Path>, ink: Ink) -> Result<(), KernelError> {
    let sizes = u32::try_from(picture.width).ok().zip(u32::try_from(picture.height).ok());
    let refused =
        KernelError::Argument { argument: "pixels", problem: "sizes do not fit a picture of four bytes each" };
    let (width, height) = sizes.ok_or(refused.clone())?;
    let mut pixmap = PixmapMut::from_bytes(picture.pixels, width, height).ok_or(refused)?;
    let mut paint = Paint { anti_alias: ink.antialias, ..Paint::default() };
    let [r, g, b, a] = ink.color;
    paint.set_color(Color::from_rgba8(r, g, b, a));
    if let Some(path) = path {
        pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 32;
    const WHITE: Ink = Ink { color: [255; 4], antialias: true };

    fn painted(work: impl FnOnce(&mut Picture<'_>) -> Result<(), KernelError>) -> Vec<u8> {
        let mut pixels = vec![0; SIZE * SIZE * 4];
        assert_eq!(work(&mut Picture { pixels: &mut pixels, width: SIZE, height: SIZE }), Ok(()));
        pixels
    }

    fn area(pixels: &[u8]) -> f64 {
        pixels.iter().skip(3).step_by(4).map(|a| f64::from(*a) / 255.0).sum()
    }

    #[test]
    fn a_pixel_is_centred_at_its_integer() {
        let corners = [(1.5, 2.5), (3.5, 2.5), (3.5, 3.5), (1.5, 3.5)].map(DVec2::from);
        let pixels = painted(|p| fill_polygon(p, &corners, WHITE));
        let lit: Vec<usize> = (0..SIZE * SIZE).filter(|i| pixels[i * 4 + 3] == 255).collect();
        assert_eq!(lit, [3 * SIZE + 2, 3 * SIZE + 3]);
        assert_eq!(area(&pixels), 2.0);
    }

    #[test]
    fn one_point_is_a_disc() {
        let pixels = painted(|p| stroke_polyline(p, &[DVec2::splat(15.3)], &[20.0], false, WHITE));
        assert!((area(&pixels) - 100.0 * PI).abs() < 1.0, "{}", area(&pixels));
    }

    #[test]
    fn a_pen_over_itself_is_filled_once_whichever_way_it_turns() {
        let ink = Ink { color: [255, 255, 255, 128], antialias: true };
        let there = [(5., 5.), (25., 5.), (25., 20.), (5., 20.), (15., 2.)].map(DVec2::from);
        for points in [there.to_vec(), there.iter().rev().copied().collect()] {
            let pixels = painted(|p| stroke_polyline(p, &points, &[8.0; 5], true, ink));
            assert_eq!(pixels.iter().skip(3).step_by(4).max(), Some(&128));
            assert_eq!(pixels[(5 * SIZE + 15) * 4 + 3], 128, "no hole where the pen crosses itself");
        }
    }

    #[test]
    fn a_taper_has_the_area_of_two_discs_hull() {
        // Hull of discs 6 and 2 at distance 12: two sectors and two trapezoids between the tangent points.
        let spread = (4.0f64 / 12.0).acos();
        let tangent = (12.0f64 * 12.0 - 16.0).sqrt();
        let want = 36.0 * (PI - spread) + 4.0 * spread + tangent * 8.0;
        let ends = [DVec2::new(9., 15.), DVec2::new(21., 15.)];
        for (points, widths) in [([ends[0], ends[1]], [12., 4.]), ([ends[1], ends[0]], [4., 12.])] {
            let pixels = painted(|p| stroke_polyline(p, &points, &widths, false, WHITE));
            assert!((area(&pixels) - want).abs() < 1.0, "{} for {want}", area(&pixels));
        }
    }

    #[test]
    fn a_disc_inside_the_other_adds_nothing() {
        let (at, near) = (DVec2::splat(15.0), DVec2::splat(16.0));
        let alone = painted(|p| stroke_polyline(p, &[at], &[20.0], false, WHITE));
        assert_eq!(alone, painted(|p| stroke_polyline(p, &[near, at], &[2.0, 20.0], false, WHITE)));
    }

    #[test]
    fn straight_colours_come_back() {
        let mut out = [9; 12];
        assert_eq!(unpremultiply(&[100, 50, 0, 200, 7, 8, 9, 255, 0, 0, 0, 0], &mut out), Ok(()));
        assert_eq!(out, [128, 64, 0, 200, 7, 8, 9, 255, 0, 0, 0, 0]);
    }

    #[test]
    fn nothing_to_draw_draws_nothing_and_wrong_numbers_are_refused() {
        assert_eq!(area(&painted(|p| fill_polygon(p, &[], WHITE))), 0.0);
        assert_eq!(area(&painted(|p| fill_polygon(p, &[DVec2::ONE; 2], WHITE))), 0.0);
        assert_eq!(area(&painted(|p| stroke_polyline(p, &[DVec2::ONE; 2], &[0.0; 2], true, WHITE))), 0.0);
        let mut pixels = vec![0; 16];
        let mut picture = Picture { pixels: &mut pixels, width: 2, height: 2 };
        let far = [DVec2::ZERO, DVec2::new(f64::NAN, 0.0)];
        assert!(matches!(fill_polygon(&mut picture, &far, WHITE), Err(KernelError::Item { index: 1, .. })));
        let got = stroke_polyline(&mut picture, &[DVec2::ZERO], &[-1.0], false, WHITE);
        assert!(matches!(got, Err(KernelError::Item { argument: "width", index: 0, .. })));
        let mut short = Picture { pixels: &mut [0; 4], width: 2, height: 2 };
        assert!(fill_polygon(&mut short, &[DVec2::ZERO], WHITE).is_err());
    }
}
