//! A triangle as a camera sees it: its attributes' shares as affine functions of the pixel.
//!
//! With corners h_k = (x z, y z, z) in homogeneous pixels, the shares b = H^-1 (x, y, 1) are affine in the pixel and
//! b_k = lambda_k / z, where lambda are the barycentric coordinates of the surface point: 1/z is their sum, and any
//! attribute is z times its shares' sum (Olano, Greer 1997). They come from the whole triangle, so a cut triangle and
//! the snapping of its corners change which samples it covers, never what lies under a sample.

use crate::clip;
use crate::error::{KernelError, check_length};
use glam::{DMat4, DVec3, DVec4};
use rayon::prelude::*;

/// Steps of a snapped coordinate in one pixel.
pub const SUBPIXELS: i32 = 256;

/// Largest length of a homogeneous pixel that is taken: its third power is still far from overflow.
const LARGEST: f64 = 1e30;

/// Triangles with corner attributes. Colours are straight RGBA; normals may be empty where nothing asks for them.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// World metres.
    pub vertices: &'a [DVec3],
    /// Three indices into the vertices each.
    pub triangles: &'a [[u32; 3]],
    /// One per vertex.
    pub colors: &'a [[f32; 4]],
    /// One per vertex, of any length, or none at all.
    pub normals: &'a [DVec3],
    /// One per triangle, 1 and above.
    pub objects: &'a [u16],
}

impl Scene<'_> {
    /// Refuses lists that do not fit together.
    pub fn check(&self) -> Result<(), KernelError> {
        check_length("colors", self.vertices.len(), self.colors.len())?;
        check_length("objects", self.triangles.len(), self.objects.len())?;
        if !self.normals.is_empty() {
            check_length("normals", self.vertices.len(), self.normals.len())?;
        }
        let count = self.vertices.len();
        match self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
            None => Ok(()),
            Some(index) => {
                Err(KernelError::Item { argument: "triangles", problem: "a vertex that does not exist", index })
            }
        }
    }

    /// A triangle's corners from a list with one entry per vertex.
    pub fn corners<T: Copy>(&self, triangle: u32, list: &[T]) -> [T; 3] {
        self.triangles[triangle as usize].map(|vertex| list[vertex as usize])
    }

    /// A triangle's normal by its winding, twice its area long.
    pub fn face_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle, self.vertices);
        (b - a).cross(c - a)
    }
}

/// A camera over a picture of `width` x `height` samples, drawn with a rim of `margin` samples around it.
#[derive(Clone, Copy)]
pub struct View {
    /// World to homogeneous pixels; the third row gives the depth in metres.
    pub matrix: [[f64; 4]; 3],
    /// Least depth that is drawn, above zero.
    pub near: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Samples around the picture that lines may grow in from.
    pub margin: usize,
}

impl View {
    /// Every vertex in homogeneous pixels.
    pub fn project(&self, vertices: &[DVec3]) -> Result<Vec<DVec3>, KernelError> {
        let [x, y, z] = self.matrix.map(DVec4::from_array);
        let matrix = DMat4::from_cols(x, y, z, DVec4::ZERO).transpose();
        let points: Vec<DVec3> = vertices.par_iter().map(|v| matrix.transform_point3(*v)).collect();
        match points.par_iter().position_first(|p| !p.is_finite() || p.abs().max_element() > LARGEST) {
            None => Ok(points),
            Some(index) => {
                let problem = "a point that is not finite or too far away";
                Err(KernelError::Item { argument: "vertices", problem, index })
            }
        }
    }
}

/// The affine functions of one triangle.
#[derive(Clone, Copy)]
pub struct Surface {
    /// Its place in the scene.
    pub triangle: u32,
    /// Its object.
    pub object: u16,
    /// +1 where the camera sees the side that the winding's normal points to, -1 at the back.
    pub facing: f32,
    /// +1 or -1: brings the corner normals to the side that the camera sees.
    pub side: f32,
    origin: [f64; 2],
    at: DVec3,
    dx: DVec3,
    dy: DVec3,
    sum: [f64; 3],
    least: f64,
    most: f64,
}

impl Surface {
    /// A triangle with its corners in homogeneous pixels, at least one of them before the near plane.
    pub fn new(scene: &Scene<'_>, triangle: u32, corners: [DVec3; 3], view: &View) -> Self {
        let front = corners.into_iter().find(|p| p.z >= view.near).unwrap_or(DVec3::Z);
        let place = |value: f64, size: usize| (value / front.z).round().clamp(0.0, size as f64);
        let origin = [place(front.x, view.width), place(front.y, view.height)];
        // Pixels are counted from a pixel near the triangle: the products below then lose no digits.
        let [a, b, c] = corners.map(|p| DVec3::new(p.x - origin[0] * p.z, p.y - origin[1] * p.z, p.z));
        let rows = [b.cross(c), c.cross(a), a.cross(b)];
        let determinant = a.dot(rows[0]);
        let reciprocals = corners.map(|p| p.z.max(view.near).recip());
        let [least, most] =
            [reciprocals.into_iter().fold(f64::INFINITY, f64::min), reciprocals.into_iter().fold(0.0, f64::max)];
        let facing = if determinant > 0.0 { -1.0 } else { 1.0 };
        let shares = rows.map(|row| row / determinant);
        let sound = shares.iter().all(|share| share.is_finite());
        // A triangle seen exactly from its edge may own a sample by snapping: it has its nearest corner's depth there.
        let column = |pick: fn(&DVec3) -> f64, flat: f64| {
            if sound { DVec3::from_array([0, 1, 2].map(|k| pick(&shares[k]))) } else { DVec3::splat(flat / 3.0) }
        };
        let (at, dx, dy) = (column(|s| s.z, most), column(|s| s.x, 0.0), column(|s| s.y, 0.0));
        Surface {
            triangle,
            object: scene.objects[triangle as usize],
            facing,
            side: side(scene, triangle, facing),
            origin,
            at,
            dx,
            dy,
            sum: [at.element_sum(), dx.element_sum(), dy.element_sum()],
            least,
            most,
        }
    }

    /// The shares (lambda / z) of the three corners at a pixel, and their change with one column.
    pub fn shares(&self, x: i32, y: i32) -> (DVec3, DVec3) {
        (self.at + self.dx * (f64::from(x) - self.origin[0]) + self.dy * (f64::from(y) - self.origin[1]), self.dx)
    }

    /// 1/z at a pixel and its change with one column, before it is held to the range.
    pub fn reciprocal(&self, x: i32, y: i32) -> (f64, f64) {
        let [at, dx, dy] = self.sum;
        (at + dx * (f64::from(x) - self.origin[0]) + dy * (f64::from(y) - self.origin[1]), dx)
    }

    /// Least and most 1/z of the triangle. A sample may lie outside by the snapping: it is held to this range.
    pub fn range(&self) -> (f64, f64) {
        (self.least, self.most)
    }

    /// The depth at a pixel.
    pub fn depth(&self, x: i32, y: i32) -> f64 {
        self.reciprocal(x, y).0.clamp(self.least, self.most).recip()
    }
}

/// Normals given against the winding are turned too, so that all look to the camera's side of the triangle.
fn side(scene: &Scene<'_>, triangle: u32, facing: f32) -> f32 {
    if scene.normals.is_empty() {
        return facing;
    }
    let mean: DVec3 = scene.corners(triangle, scene.normals).into_iter().sum();
    if mean.dot(scene.face_normal(triangle)) >= 0.0 { facing } else { -facing }
}

/// A convex piece of a triangle on the screen: snapped corners, the topmost first.
#[derive(Clone, Copy)]
pub struct Face {
    /// In 1/256 pixels, by falling y.
    pub corners: [[i32; 2]; 3],
    /// Index of its surface.
    pub surface: u32,
}

impl Face {
    /// First row with samples, and the row after the last one.
    pub fn rows(&self) -> (i32, i32) {
        (first_sample(self.corners[0][1]), first_sample(self.corners[2][1]))
    }

    fn new(mut corners: [[i32; 2]; 3]) -> Self {
        corners.sort_unstable_by_key(|c| c[1]);
        Face { corners, surface: 0 }
    }

    /// Whether any sample of the picture may lie inside.
    fn is_seen(&self, view: &View) -> bool {
        let (top, bottom) = self.rows();
        let columns = self.corners.map(|c| c[0]);
        let left = columns.into_iter().min().map_or(0, first_sample);
        let right = columns.into_iter().max().map_or(0, first_sample);
        let (margin, width, height) = (view.margin as i32, view.width as i32, view.height as i32);
        top.max(-margin) < bottom.min(height + margin) && left.max(-margin) < right.min(width + margin)
    }
}

/// The first pixel at or after a snapped coordinate.
pub fn first_sample(coordinate: i32) -> i32 {
    (coordinate + (SUBPIXELS - 1)).div_euclid(SUBPIXELS)
}

fn snap(point: DVec3) -> [i32; 2] {
    let scale = f64::from(SUBPIXELS);
    [(point.x / point.z * scale).round() as i32, (point.y / point.z * scale).round() as i32]
}

/// The visible pieces of one triangle.
fn faces_of(corners: [DVec3; 3], view: &View, mut take: impl FnMut(Face)) {
    if corners.iter().all(|p| clip::is_inside(*p, view.near)) {
        let face = Face::new(corners.map(snap));
        if face.is_seen(view) {
            take(face);
        }
    } else if corners.iter().any(|p| p.z >= view.near) {
        let polygon = clip::clip(corners, view.near);
        let points = polygon.corners();
        for pair in points.windows(2).skip(1) {
            let face = Face::new([points[0], pair[0], pair[1]].map(snap));
            if face.is_seen(view) {
                take(face);
            }
        }
    }
}

/// What of a scene may be seen: pieces in the order of their triangles, and the triangles' functions.
pub fn visible(scene: &Scene<'_>, view: &View) -> Result<(Vec<Face>, Vec<Surface>), KernelError> {
    const CHUNK: usize = 4096;
    let points = view.project(scene.vertices)?;
    let corners = |triangle: u32| scene.corners(triangle, &points);
    let pieces: Vec<Vec<Face>> = (0..scene.triangles.len())
        .into_par_iter()
        .step_by(CHUNK)
        .map(|first| {
            let mut faces = Vec::new();
            for triangle in first..(first + CHUNK).min(scene.triangles.len()) {
                let surface = triangle as u32;
                faces_of(corners(surface), view, |face| faces.push(Face { surface, ..face }));
            }
            faces
        })
        .collect();
    let mut faces = pieces.concat();
    let mut triangles = Vec::new();
    for face in &mut faces {
        if triangles.last() != Some(&face.surface) {
            triangles.push(face.surface);
        }
        face.surface = triangles.len() as u32 - 1;
    }
    let surfaces = triangles.into_par_iter().map(|t| Surface::new(scene, t, corners(t), view)).collect();
    Ok((faces, surfaces))
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: View = View {
        matrix: [[8.0, 0.0, 4.0, 0.0], [0.0, 8.0, 4.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        near: 0.5,
        width: 8,
        height: 8,
        margin: 0,
    };

    fn surface(vertices: [DVec3; 3]) -> Surface {
        let scene =
            Scene { vertices: &vertices, triangles: &[[0, 1, 2]], colors: &[[1.0; 4]; 3], normals: &[], objects: &[1] };
        let corners = VIEW.project(&vertices).unwrap_or_default();
        Surface::new(&scene, 0, [corners[0], corners[1], corners[2]], &VIEW)
    }

    #[test]
    fn depth_is_where_the_ray_meets_the_plane() {
        // The plane z = 2 + x: a ray (u, v, 1) meets it at z = 2 / (1 - u).
        let slanted = surface([DVec3::new(-1., -1., 1.), DVec3::new(1., -1., 3.), DVec3::new(0., 1., 2.)]);
        for (x, y) in [(2, 2), (4, 4), (5, 3)] {
            let u = (f64::from(x) - 4.0) / 8.0;
            assert!((slanted.depth(x, y) - 2.0 / (1.0 - u)).abs() < 1e-12);
            let (shares, _) = slanted.shares(x, y);
            assert!((shares.element_sum().recip() - slanted.depth(x, y)).abs() < 1e-12);
        }
        assert_eq!((slanted.depth(-999, 4), slanted.depth(11, 4)), (1.0, 3.0));
    }

    #[test]
    fn a_triangle_seen_from_its_edge_has_its_nearest_depth() {
        let edge_on = surface([DVec3::new(0., 0., 1.), DVec3::new(0., 0., 2.), DVec3::new(0., 1., 2.)]);
        assert_eq!(edge_on.depth(3, 5), 1.0);
        assert!(edge_on.shares(3, 5).0.is_finite());
    }

    #[test]
    fn facing_follows_the_winding() {
        let corners = [DVec3::new(0., 0., 2.), DVec3::new(1., 0., 2.), DVec3::new(0., 1., 2.)];
        assert_eq!(surface(corners).facing, -1.0);
        assert_eq!(surface([corners[1], corners[0], corners[2]]).facing, 1.0);
    }

    #[test]
    fn the_first_sample_is_the_ceiling() {
        assert_eq!([-257, -256, -1, 0, 1, 256].map(first_sample), [-1, -1, 0, 0, 1, 1]);
    }
}
