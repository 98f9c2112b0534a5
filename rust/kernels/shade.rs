//! Colours of covered samples: flat, or in bands of brightness by the angle to a light.
//!
//! Attributes are perspective-correct: the sum of the corners' values times their shares lambda / z, divided by the sum
//! of the shares. Bands: the cosine between the two-sided normal and the direction to the light runs from -1 (the first
//! band) to 1 (the last); the bands divide it evenly, so that two bands meet where the light just grazes.

use crate::error::KernelError;
use crate::surface::{Scene, Surface};
use glam::{DVec3, Vec3, Vec4};

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
    light: DVec3,
    /// The band that the cosine -1 lies in.
    first: f32,
    /// Where every further band begins (the cosine times its own size) and its factor.
    further: Vec<(f32, f32)>,
    banded: bool,
}

impl<'a> Shader<'a> {
    /// Without bands colours are as they are.
    pub fn new(scene: &'a Scene<'a>, toon: Toon<'_>) -> Result<Self, KernelError> {
        let Some(light) = toon.light.try_normalize() else {
            return Err(KernelError::Argument { argument: "light", problem: "want a finite direction, not zero" });
        };
        if let Some(index) = toon.bands.iter().position(|factor| !(factor.is_finite() && *factor >= 0.0)) {
            let problem = "want finite factors of zero or more, got another";
            return Err(KernelError::Item { argument: "bands", problem, index });
        }
        let banded = !toon.bands.is_empty();
        if banded && scene.normals.len() != scene.vertices.len() {
            return Err(KernelError::Argument { argument: "normals", problem: "bands need one normal per vertex" });
        }
        let count = toon.bands.len() as f32;
        let begin = |band: usize| 2.0 * band as f32 / count - 1.0;
        let further = toon.bands.iter().enumerate().skip(1).map(|(k, factor)| (begin(k) * begin(k).abs(), *factor));
        let first = toon.bands.first().copied().unwrap_or(1.0);
        Ok(Shader { scene, light, first, further: further.collect(), banded })
    }

    /// Colours a run of samples of one surface in one row, premultiplied; their depths are known.
    pub fn run(&self, surface: &Surface, x: i32, y: i32, depths: &[f32], out: &mut [[f32; 4]]) {
        let [a, b, c] = self.scene.corners(surface.triangle, self.scene.colors).map(Vec4::from_array);
        if a == b && b == c {
            out.fill(premultiplied(a));
        } else {
            // A sample may lie outside of the triangle by the snapping: colours stay between the corners'.
            let (least, most) = (a.min(b).min(c), a.max(b).max(c));
            let (shares, step) = surface.shares(x, y);
            let mix = |s: DVec3| a * s.x as f32 + b * s.y as f32 + c * s.z as f32;
            let (from, change) = (mix(shares), mix(step));
            for (i, (pixel, depth)) in out.iter_mut().zip(depths).enumerate() {
                *pixel = premultiplied(((from + change * i as i32 as f32) * *depth).max(least).min(most));
            }
        }
        if self.banded {
            self.band(surface, x, y, out);
        }
    }

    /// Multiplies the bands' factors in, four samples at a time.
    fn band(&self, surface: &Surface, x: i32, y: i32, out: &mut [[f32; 4]]) {
        let [a, b, c] = self.scene.corners(surface.triangle, self.scene.normals).map(|n| n * f64::from(surface.side));
        let (shares, step) = surface.shares(x, y);
        let mix = |s: DVec3| {
            let normal = a * s.x + b * s.y + c * s.z;
            normal.extend(normal.dot(self.light)).as_vec4()
        };
        let (from, change) = (mix(shares), mix(step));
        let mut along = Vec4::new(0.0, 1.0, 2.0, 3.0);
        for pixels in out.chunks_mut(4) {
            let factors = self.factors(from, change, along).to_array();
            for (pixel, factor) in pixels.iter_mut().zip(factors) {
                *pixel = (Vec4::from_array(*pixel) * Vec3::splat(factor).extend(1.0)).to_array();
            }
            along += 4.0;
        }
    }

    /// The factors where normal and product with the light (w) are `from` + `along` * `change`. Products and bounds
    /// are squared with their signs kept, which spares the root of the normal's length.
    fn factors(&self, from: Vec4, change: Vec4, along: Vec4) -> Vec4 {
        let value = |k: usize| along * change[k] + from[k];
        let (x, y, z, product) = (value(0), value(1), value(2), value(3));
        let (squared, signed) = (x * x + y * y + z * z, product * product.abs());
        self.further.iter().fold(Vec4::splat(self.first), |factors, (begin, factor)| {
            Vec4::select(signed.cmpge(squared * *begin), Vec4::splat(*factor), factors)
        })
    }
}

/// A straight colour with its alpha multiplied in.
pub fn premultiplied(color: Vec4) -> [f32; 4] {
    (color * color.w).truncate().extend(color.w).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_begin_where_the_cosine_is_even() {
        let scene = Scene { vertices: &[], triangles: &[], colors: &[], normals: &[], objects: &[] };
        let toon = Toon { light: DVec3::new(0.0, 3.0, 0.0), bands: &[0.1, 0.2, 0.3, 0.4] };
        let Ok(shader) = Shader::new(&scene, toon) else { unreachable!() };
        // A normal of length 2 turns from the light's far side to the light: products with it in w.
        let along = Vec4::new(-1.01, -0.99, -0.01, 0.01);
        let got = shader.factors(Vec4::new(2.0, 0.0, 0.0, 0.0), Vec4::new(0.0, 0.0, 0.0, 1.0), along);
        assert_eq!(got, Vec4::new(0.1, 0.2, 0.2, 0.3));
        let got = shader.factors(Vec4::new(2.0, 0.0, 0.0, 0.0), Vec4::new(0.0, 0.0, 0.0, 1.0), -along);
        assert_eq!(got, Vec4::new(0.4, 0.3, 0.3, 0.2));
    }

    #[test]
    fn light_bands_and_normals_are_checked() {
        let scene = Scene { vertices: &[DVec3::X], triangles: &[], colors: &[], normals: &[], objects: &[] };
        let refused = |light, bands| match Shader::new(&scene, Toon { light, bands }) {
            Err(KernelError::Argument { argument, .. } | KernelError::Item { argument, .. }) => argument,
            _ => "",
        };
        assert_eq!(refused(DVec3::ZERO, &[]), "light");
        assert_eq!(refused(DVec3::X, &[1.0, f32::NAN]), "bands");
        assert_eq!(refused(DVec3::X, &[1.0]), "normals");
        assert_eq!(refused(DVec3::X, &[]), "");
    }
}
