//! A picture with alpha over an opaque ground: what an animation's frame shows.

use crate::error::{KernelError, check_length};
use rayon::prelude::*;

/// Pixels that one task works on.
const BLOCK: usize = 1 << 14;

/// Puts straight RGBA pixels over `ground`, which is one colour or as many pixels, and writes RGB.
pub fn over_ground(drawn: &[[u8; 4]], ground: &[[u8; 3]], out: &mut [[u8; 3]]) -> Result<(), KernelError> {
    check_length("out", drawn.len(), out.len())?;
    if let &[color] = ground {
        out.par_chunks_mut(BLOCK).zip(drawn.par_chunks(BLOCK)).for_each(|(out, drawn)| {
            for (target, pixel) in out.iter_mut().zip(drawn) {
                *target = mixed(pixel, color);
            }
        });
        return Ok(());
    }
    check_length("ground", drawn.len(), ground.len())?;
    let blocks = out.par_chunks_mut(BLOCK).zip(drawn.par_chunks(BLOCK)).zip(ground.par_chunks(BLOCK));
    blocks.for_each(|((out, drawn), ground)| {
        for ((target, pixel), &below) in out.iter_mut().zip(drawn).zip(ground) {
            *target = mixed(pixel, below);
        }
    });
    Ok(())
}

/// One pixel, rounded to the nearest.
#[inline(always)]
fn mixed(&[red, green, blue, alpha]: &[u8; 4], below: [u8; 3]) -> [u8; 3] {
    // Most pixels are one or the other.
    match alpha {
        0 => return below,
        255 => return [red, green, blue],
        _ => (),
    }
    let cover = u32::from(alpha);
    let mix = |upper: u8, lower: u8| {
        let sum = u32::from(upper) * cover + u32::from(lower) * (255 - cover) + 128;
        ((sum + (sum >> 8)) >> 8) as u8
    };
    [mix(red, below[0]), mix(green, below[1]), mix(blue, below[2])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mixture_is_rounded_to_the_nearest() {
        for alpha in 0..=255u8 {
            for upper in 0..=255u8 {
                let [found, ..] = mixed(&[upper, 0, 0, alpha], [77, 0, 0]);
                let exact = (f64::from(upper) * f64::from(alpha) + 77.0 * f64::from(255 - alpha)) / 255.0;
                assert_eq!(f64::from(found), exact.round(), "{upper} at {alpha}");
            }
        }
    }

    #[test]
    fn a_ground_is_one_colour_or_a_picture() -> Result<(), KernelError> {
        let drawn = [[10, 20, 30, 255], [1, 2, 3, 0]];
        let mut out = [[0; 3]; 2];
        over_ground(&drawn, &[[9, 8, 7]], &mut out)?;
        assert_eq!(out, [[10, 20, 30], [9, 8, 7]]);
        over_ground(&drawn, &[[9, 8, 7], [4, 5, 6]], &mut out)?;
        assert_eq!(out, [[10, 20, 30], [4, 5, 6]]);
        assert!(over_ground(&drawn, &[[0; 3]; 3], &mut out).is_err());
        Ok(())
    }
}
