//! `pegbar._kernels`: registers the wrappers; each file carries its kernel's name.

mod amc;
mod arrays;
mod bvh;
mod cloth;
mod color;
mod composite;
mod deform;
mod depth;
mod descriptor;
mod errors;
mod geodesic;
mod gif;
mod grow;
mod holdout;
mod kinematics;
mod lift;
mod matte;
mod over;
mod paint;
mod palette;
mod particles;
mod pose;
mod raster;
mod resample;
mod rim;
mod search;
mod segment;
mod signs;
mod strand;
mod textured;
mod triangulate;
mod warp;

use pyo3::prelude::*;

/// The Rust kernels of pegbar. Strict and private: call the functions of the `pegbar` package instead.
#[pymodule(gil_used = false)]
mod _kernels {
    /// Of which sources the extension was built.
    #[pymodule_export]
    const SOURCES: &str = env!("PEGBAR_SOURCES");
    #[pymodule_export]
    use crate::amc::parse_amc;
    #[pymodule_export]
    use crate::bvh::parse_bvh;
    #[pymodule_export]
    use crate::cloth::{capsule_distances, step_cloth};
    #[pymodule_export]
    use crate::color::convert_srgb;
    #[pymodule_export]
    use crate::composite::depth_composite;
    #[pymodule_export]
    use crate::deform::{Deformer, average_triangles, fit_triangles};
    #[pymodule_export]
    use crate::depth::limb_depth;
    #[pymodule_export]
    use crate::descriptor::pose_distance;
    #[pymodule_export]
    use crate::geodesic::geodesic_labels;
    #[pymodule_export]
    use crate::gif::pack_gif_frames;
    #[pymodule_export]
    use crate::grow::grow_labels;
    #[pymodule_export]
    use crate::holdout::composite_matte;
    #[pymodule_export]
    use crate::kinematics::forward_kinematics;
    #[pymodule_export]
    use crate::lift::lift_markers;
    #[pymodule_export]
    use crate::matte::{fill_matte, has_alpha, ink_alpha, matte, own_alpha};
    #[pymodule_export]
    use crate::over::over_ground;
    #[pymodule_export]
    use crate::paint::{fill_polygon, stroke_polyline, unpremultiply};
    #[pymodule_export]
    use crate::palette::palette_labels;
    #[pymodule_export]
    use crate::particles::step_particles;
    #[pymodule_export]
    use crate::pose::fit_poses;
    #[pymodule_export]
    use crate::raster::{render_passes, resolve_passes};
    #[pymodule_export]
    use crate::resample::{nearest_view, resample_view};
    #[pymodule_export]
    use crate::rim::rim_depth;
    #[pymodule_export]
    use crate::search::{search_clips, segment_rows};
    #[pymodule_export]
    use crate::segment::segment_stick_figure;
    #[pymodule_export]
    use crate::signs::{length_costs, limb_depths};
    #[pymodule_export]
    use crate::strand::step_strands;
    #[pymodule_export]
    use crate::textured::render_sheet;
    #[pymodule_export]
    use crate::triangulate::{constrained_delaunay, inside_rings};
    #[pymodule_export]
    use crate::warp::time_warp;
}
