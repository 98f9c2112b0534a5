//! Colours of covered samples: flat, or in bands of brightness by the angle to a light.
//!
//! Attributes are perspective-correct: the sum of the corners' values times their shares lambda / z, divided by the sum
//! of the shares. Bands: the cosine between the two-sided normal and the direction to the light runs from -1 (the first
//! band) to 1 (the last); the bands divide it evenly, so that two bands meet where the light just grazes.

use crate::error::KernelError;
use crate::surface::{Scene, Surface};
use glam::{DVec3, Vec3, Vec4};

/// Samples that are worked at a time.
const LANES: usize = 64;

/// Brightness in steps.
#[derive(Clone, Copy)]
pub struct Toon<'a> {
    /// World direction towards the light, of any length above zero.
    pub light: DVec3,
    /// Factors on the colour, from the side turned away to the side turned towards the light.
    pub bands: &'a [f32],
}

/// Colours a scene's samples.
pub struct Shader<'a> {
    scene: &'a Scene<'a>,
    light: Vec3,
    bands: &'a [f32],
}

impl<'a> Shader<'a> {
    /// Without bands colours are as they are.
    pub fn new(scene: &'a Scene<'a>, toon: Toon<'a>) -> Result<Self, KernelError> {
        let Some(light) = toon.light.try_normalize() else {
            return Err(KernelError::Argument { argument: "light", problem: "want a finite direction, not zero" });
        };
        if let Some(index) = toon.bands.iter().position(|factor| !(factor.is_finite() && *factor >= 0.0)) {
            let problem = "want finite factors of zero or more, got another";
            return Err(KernelError::Item { argument: "bands", problem, index });
        }
        if !toon.bands.is_empty() && scene.normals.len() != scene.vertices.len() {
            return Err(KernelError::Argument { argument: "normals", problem: "bands need one normal per vertex" });
        }
        Ok(Shader { scene, light: light.as_vec3(), bands: toon.bands })
    }

    /// Colours a run of samples of one surface in one row, premultiplied.
    pub fn run(&self, surface: &Surface, x: i32, y: i32, out: &mut [[f32; 4]]) {
        self.color(surface, x, y, out);
        if !self.bands.is_empty() {
            self.band(surface, x, y, out);
        }
    }

    fn color(&self, surface: &Surface, x: i32, y: i32, out: &mut [[f32; 4]]) {
        let corners = self.scene.corners(surface.triangle, self.scene.colors);
        let [a, b, c] = corners.map(Vec4::from_array);
        if a == b && b == c {
            out.fill(premultiplied(a));
            return;
        }
        // A sample may lie outside of the triangle by the snapping: colours stay between the corners'.
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        let (shares, step) = surface.shares(x, y);
        let mix = |s: DVec3| a * s.x as f32 + b * s.y as f32 + c * s.z as f32;
        let (from, change) = (mix(shares), mix(step));
        let (from_reciprocal, change_reciprocal) = (shares.element_sum() as f32, step.element_sum() as f32);
        for (i, pixel) in out.iter_mut().enumerate() {
            let i = i as f32;
            let depth = (from_reciprocal + i * change_reciprocal).recip();
            *pixel = premultiplied(((from + change * i) * depth).max(least).min(most));
        }
    }

    fn band(&self, surface: &Surface, x: i32, y: i32, out: &mut [[f32; 4]]) {
        let [a, b, c] = self.scene.corners(surface.triangle, self.scene.normals).map(|n| n * f64::from(surface.side));
        let (shares, step) = surface.shares(x, y);
        let mix = |s: DVec3| (a * s.x + b * s.y + c * s.z).as_vec3();
        let (mut from, change) = (mix(shares), mix(step));
        let mut levels = [0u32; LANES];
        for pixels in out.chunks_mut(LANES) {
            self.levels(from, change, &mut levels[..pixels.len()]);
            for (pixel, level) in pixels.iter_mut().zip(&levels) {
                let factor = self.bands[*level as usize];
                *pixel = (Vec4::from_array(*pixel) * Vec4::new(factor, factor, factor, 1.0)).to_array();
            }
            from += change * LANES as f32;
        }
    }

    /// The band of every sample in a run.
    fn levels(&self, from: Vec3, change: Vec3, out: &mut [u32]) {
        let half = self.bands.len() as f32 * 0.5;
        let last = self.bands.len() as f32 - 1.0;
        let (toward, toward_change) = (from.dot(self.light), change.dot(self.light));
        for (i, level) in out.iter_mut().enumerate() {
            let i = i as i32 as f32;
            let (x, y, z) = (from.x + i * change.x, from.y + i * change.y, from.z + i * change.z);
            let length = (x * x + y * y + z * z).sqrt();
            let length = if length > f32::MIN_POSITIVE { length } else { f32::MIN_POSITIVE };
            let place = ((toward + i * toward_change) / length + 1.0) * half;
            let place = if place > 0.0 { place } else { 0.0 };
            *level = (if place < last { place } else { last }) as i32 as u32;
        }
    }
}

/// A straight colour with its alpha multiplied in.
pub fn premultiplied(color: Vec4) -> [f32; 4] {
    (color * color.w).truncate().extend(color.w).to_array()
}
