//! Renders triangle meshes under any 3x4 camera: beauty, depth, coverage and object id, one sample a pixel.
//!
//! A z-buffer of 1/z and surface numbers is filled band by band, then every covered sample is shaded once (deferred). Depth
//! is the planar z of the surface at the sample's centre, +inf where nothing is. Of samples at equal depth the
//! earlier triangle's stays. Every row is worked alone, so neither bands nor threads change a bit of the result.

use crate::band::Band;
use crate::error::{KernelError, check_length};
use crate::ink::{self, Ink, Pen};
use crate::shade::{Shader, Toon, premultiplied};
use crate::surface::{Face, Scene, Surface, View, visible};
use glam::Vec4;
use rayon::prelude::*;
use std::ops::Range;

/// Rows of a band: its two buffers should stay in a core's cache.
const BAND_ROWS: usize = 32;

/// Largest picture side: far within the pixels that triangles are cut to.
const LARGEST_SIDE: usize = 1 << 18;

/// The pictures to fill, row-major, of one size.
pub struct Passes<'a> {
    /// Premultiplied RGBA.
    pub beauty: &'a mut [[f32; 4]],
    /// Planar depth in metres, +inf background.
    pub depth: &'a mut [f32],
    /// 1 where a surface is, 0 elsewhere.
    pub coverage: &'a mut [f32],
    /// The nearest surface's object, 0 background.
    pub object_id: &'a mut [u16],
}

impl Passes<'_> {
    /// Row by row.
    fn rows(&mut self, width: usize) -> impl Iterator<Item = Passes<'_>> {
        let Passes { beauty, depth, coverage, object_id } = self;
        let colors = beauty.chunks_mut(width).zip(depth.chunks_mut(width));
        let others = coverage.chunks_mut(width).zip(object_id.chunks_mut(width));
        colors.zip(others).map(|((beauty, depth), (coverage, object_id))| Passes { beauty, depth, coverage, object_id })
    }

    /// `samples` samples at a time, in parallel.
    pub fn bands(&mut self, samples: usize) -> impl IndexedParallelIterator<Item = Passes<'_>> {
        let Passes { beauty, depth, coverage, object_id } = self;
        let colors = beauty.par_chunks_mut(samples).zip(depth.par_chunks_mut(samples));
        let others = coverage.par_chunks_mut(samples).zip(object_id.par_chunks_mut(samples));
        colors.zip(others).map(|((beauty, depth), (coverage, object_id))| Passes { beauty, depth, coverage, object_id })
    }

    /// Refuses pictures that do not hold `size` pixels each.
    pub fn check(&self, size: usize) -> Result<(), KernelError> {
        check_length("beauty", size, self.beauty.len())?;
        check_length("depth", size, self.depth.len())?;
        check_length("coverage", size, self.coverage.len())?;
        check_length("object_id", size, self.object_id.len())
    }

    fn fill_object(&mut self, samples: Range<usize>, object: u16) {
        self.coverage[samples.clone()].fill(if object > 0 { 1.0 } else { 0.0 });
        self.object_id[samples].fill(object);
    }
}

/// A scene made ready for its bands.
struct Job<'a> {
    view: &'a View,
    faces: &'a [Face],
    surfaces: &'a [Surface],
    bins: Bins,
    shader: Shader<'a>,
    ink: Ink,
    pen: Option<Pen<'a>>,
}

/// Renders a scene, with lines where `ink` has a width.
pub fn render_passes(
    scene: &Scene<'_>,
    view: &View,
    toon: Toon<'_>,
    ink: Ink,
    mut out: Passes<'_>,
) -> Result<(), KernelError> {
    scene.check()?;
    ink.check()?;
    check_view(view)?;
    out.check(view.width * view.height)?;
    let view = &View { margin: ink.margin(), ..*view };
    let shader = Shader::new(scene, toon)?;
    let (faces, surfaces) = visible(scene, view)?;
    let rows = BAND_ROWS.max(4 * view.margin);
    let bins = Bins::new(&faces, view, rows);
    let facets = if ink.width > 0.0 { ink::facets(scene, &surfaces) } else { Vec::new() };
    let pen = (ink.width > 0.0).then(|| Pen::new(&ink, &surfaces, &facets));
    let job = Job { view, faces: &faces, surfaces: &surfaces, bins, shader, ink, pen };
    out.bands((view.width * rows).max(1)).enumerate().for_each_init(
        || (Band::new(view, rows + 2 * view.margin), Vec::new()),
        |(band, owners), (index, out)| job.render_band(index, band, owners, out),
    );
    Ok(())
}

impl Job<'_> {
    fn render_band(&self, index: usize, band: &mut Band, owners: &mut Vec<u32>, mut out: Passes<'_>) {
        let (first, margin) = ((index * self.bins.rows) as i32, self.view.margin as i32);
        let rows = first..first + (out.depth.len() / self.view.width) as i32;
        band.place(&(rows.start - margin..rows.end + margin));
        band.draw(self.bins.faces(index).iter().map(|&face| &self.faces[face as usize]), self.surfaces);
        if let Some(pen) = &self.pen {
            pen.draw(band, owners);
        }
        for (row, mut out) in rows.zip(out.rows(self.view.width)) {
            self.shade_row(band, row, &mut out);
            if self.pen.is_some() {
                self.ink_row(band, owners, row, &mut out);
            }
        }
    }

    fn shade_row(&self, band: &Band, row: i32, out: &mut Passes<'_>) {
        let (mut column, mut since, mut object) = (0, 0, 0);
        for run in band.surface[band.samples_of(row)].chunk_by(|a, b| a == b) {
            let samples = column..column + run.len();
            let surface = self.surfaces.get((run[0] as usize).wrapping_sub(1));
            let (beauty, depth) = (&mut out.beauty[samples.clone()], &mut out.depth[samples.clone()]);
            match surface {
                None => {
                    beauty.fill([0.0; 4]);
                    depth.fill(f32::INFINITY);
                }
                Some(surface) => {
                    fill_depth(surface, column as i32, row, depth);
                    self.shader.run(surface, column as i32, row, depth, beauty);
                }
            }
            let here = surface.map_or(0, |surface| surface.object);
            if here != object {
                out.fill_object(since..column, object);
                (since, object) = (column, here);
            }
            column = samples.end;
        }
        out.fill_object(since..column, object);
    }

    fn ink_row(&self, band: &Band, owners: &[u32], row: i32, out: &mut Passes<'_>) {
        let color = Vec4::from_array(premultiplied(Vec4::from_array(self.ink.color)));
        for (column, owner) in owners[band.samples_of(row)].iter().enumerate().filter(|(_, owner)| **owner > 0) {
            let source = *owner as usize - 1;
            let surface = &self.surfaces[band.surface[source] as usize - 1];
            let [x, y] = band.place_of(source);
            out.beauty[column] = (color + Vec4::from_array(out.beauty[column]) * (1.0 - color.w)).to_array();
            out.depth[column] = surface.depth(x, y) as f32;
            out.coverage[column] = 1.0;
            out.object_id[column] = surface.object;
        }
    }
}

fn fill_depth(surface: &Surface, x: i32, y: i32, out: &mut [f32]) {
    let (from, step) = surface.reciprocal(x, y);
    let (least, most) = surface.range();
    for (i, depth) in out.iter_mut().enumerate() {
        let here = from + f64::from(i as i32) * step;
        let here = if here < least { least } else { here };
        let here = if here > most { most } else { here };
        *depth = here.recip() as f32;
    }
}

fn check_view(view: &View) -> Result<(), KernelError> {
    if !(view.near.is_finite() && view.near > 0.0) {
        return Err(KernelError::Argument { argument: "near", problem: "want a finite depth above zero" });
    }
    if view.width.max(view.height) > LARGEST_SIDE {
        return Err(KernelError::Argument { argument: "camera", problem: "want at most 262144 samples a side" });
    }
    Ok(())
}

/// Which faces reach into which band of `rows` rows, in the faces' order.
struct Bins {
    rows: usize,
    starts: Vec<u32>,
    faces: Vec<u32>,
}

impl Bins {
    fn new(faces: &[Face], view: &View, rows: usize) -> Self {
        let count = view.height.div_ceil(rows);
        let mut starts = vec![0u32; count + 1];
        for face in faces {
            bands_of(face, view, rows).for_each(|band| starts[band + 1] += 1);
        }
        for band in 0..count {
            starts[band + 1] += starts[band];
        }
        let mut next = starts.clone();
        let mut places = vec![0; starts[count] as usize];
        for (index, face) in faces.iter().enumerate() {
            for band in bands_of(face, view, rows) {
                places[next[band] as usize] = index as u32;
                next[band] += 1;
            }
        }
        Bins { rows, starts, faces: places }
    }

    fn faces(&self, band: usize) -> &[u32] {
        &self.faces[self.starts[band] as usize..self.starts[band + 1] as usize]
    }
}

/// The bands whose rows, margin included, a face reaches.
fn bands_of(face: &Face, view: &View, rows: usize) -> Range<usize> {
    let (top, bottom) = face.rows();
    let (margin, height) = (view.margin as i32, view.height as i32);
    let first = (top - margin).clamp(0, height) as usize / rows;
    let last = (bottom + margin).clamp(0, height) as usize;
    first..last.div_ceil(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const NO_INK: Ink = Ink { width: 0.0, color: [0.0; 4], crease_angle: 7.0, depth_jump: 0.01 };

    /// Depths and objects of squares (left, right, depth) that are two pixels high, in a picture of `height` rows.
    fn render(squares: &[[f64; 3]], height: usize, ink: Ink) -> Result<(Vec<f32>, Vec<u16>), KernelError> {
        let (mut vertices, mut triangles, mut objects) = (Vec::new(), Vec::new(), Vec::new());
        for (index, [left, right, z]) in squares.iter().enumerate() {
            let first = vertices.len() as u32;
            let corners = [[*left, 0.0], [*right, 0.0], [*right, 2.0], [*left, 2.0]];
            vertices.extend(corners.map(|[x, y]| DVec3::new(x * z, y * z, *z)));
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            objects.extend([index as u16 + 1; 2]);
        }
        let colors = vec![[1.0; 4]; vertices.len()];
        let scene =
            Scene { vertices: &vertices, triangles: &triangles, colors: &colors, normals: &[], objects: &objects };
        let matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let view = View { matrix, near: 0.5, width: 4, height, margin: 0 };
        let size = 4 * height;
        let (mut beauty, mut depth) = (vec![[9.0; 4]; size], vec![9.0; size]);
        let (mut coverage, mut object_id) = (vec![9.0; size], vec![9; size]);
        let out = Passes { beauty: &mut beauty, depth: &mut depth, coverage: &mut coverage, object_id: &mut object_id };
        render_passes(&scene, &view, Toon { light: DVec3::Y, bands: &[] }, ink, out)?;
        for (pixel, object) in object_id.iter().enumerate() {
            let covered = f32::from(u8::from(*object > 0));
            assert_eq!((coverage[pixel], beauty[pixel][3], depth[pixel].is_finite()), (covered, covered, *object > 0));
        }
        Ok((depth, object_id))
    }

    #[test]
    fn the_nearer_stays_and_of_equals_the_earlier() {
        let got = render(&[[1.0, 4.0, 3.0], [2.0, 4.0, 2.0], [3.0, 4.0, 2.0]], 3, NO_INK);
        let inf = f32::INFINITY;
        let (row, ids) = ([inf, 3.0, 2.0, 2.0], [0, 1, 2, 2]);
        let want = ([row, row, [inf; 4]].concat(), [ids, ids, [0; 4]].concat());
        assert_eq!(got, Ok(want));
    }

    #[test]
    fn every_sample_is_written_in_bands_without_faces_too() {
        let got = render(&[], 3 * BAND_ROWS + 1, NO_INK).map(|(depth, _)| depth.iter().all(|z| z.is_infinite()));
        assert_eq!(got, Ok(true));
        assert!(render(&[], 0, NO_INK).is_ok());
    }

    #[test]
    fn a_line_grows_below_its_object_with_its_depth() {
        let ink = Ink { width: 1.0, color: [0.0, 0.0, 0.0, 1.0], ..NO_INK };
        let inf = f32::INFINITY;
        let got = render(&[[1.0, 2.0, 3.0]], 4, ink).map(|(depth, _)| depth);
        assert_eq!(got, Ok([[3.0, 3.0, 3.0, inf], [3.0, 3.0, 3.0, inf], [3.0, 3.0, 3.0, inf], [inf; 4]].concat()));
    }

    #[test]
    fn lists_and_options_that_do_not_fit_are_refused() {
        assert!(matches!(
            render(&[], 4, Ink { width: f32::NAN, ..NO_INK }),
            Err(KernelError::Argument { argument: "ink", .. })
        ));
        let (matrix, width, height) = ([[0.0; 4]; 3], LARGEST_SIDE + 1, 1);
        let view = View { matrix, near: 1.0, width, height, margin: 0 };
        assert!(matches!(check_view(&view), Err(KernelError::Argument { argument: "camera", .. })));
        let scene = Scene {
            vertices: &[DVec3::ZERO],
            triangles: &[[0, 0, 1]],
            colors: &[[0.0; 4]],
            normals: &[],
            objects: &[1],
        };
        assert!(matches!(scene.check(), Err(KernelError::Item { argument: "triangles", index: 0, .. })));
        let scene = Scene { triangles: &[[0; 3]], objects: &[], ..scene };
        assert!(matches!(scene.check(), Err(KernelError::Length { argument: "objects", wanted: 1, got: 0 })));
    }
}
