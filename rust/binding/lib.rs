//! `pegbar._kernels`: registers the wrappers; each file carries its kernel's name.

mod arrays;
mod color;
mod composite;
mod depth;
mod errors;
mod grow;
mod holdout;
mod lift;
mod matte;
mod paint;
mod palette;
mod raster;
mod rim;
mod segment;
mod signs;

use pyo3::prelude::*;

/// The Rust kernels of pegbar. Strict and private: call the functions of the `pegbar` package instead.
#[pymodule(gil_used = false)]
mod _kernels {
    #[pymodule_export]
    use crate::color::convert_srgb;
    #[pymodule_export]
    use crate::composite::depth_composite;
    #[pymodule_export]
    use crate::depth::limb_depth;
    #[pymodule_export]
    use crate::grow::grow_labels;
    #[pymodule_export]
    use crate::holdout::composite_matte;
    #[pymodule_export]
    use crate::lift::lift_markers;
    #[pymodule_export]
    use crate::matte::{fill_matte, has_alpha, ink_alpha, matte, own_alpha};
    #[pymodule_export]
    use crate::paint::{fill_polygon, stroke_polyline, unpremultiply};
    #[pymodule_export]
    use crate::palette::palette_labels;
    #[pymodule_export]
    use crate::raster::{render_passes, resolve_passes};
    #[pymodule_export]
    use crate::rim::rim_depth;
    #[pymodule_export]
    use crate::segment::segment_stick_figure;
    #[pymodule_export]
    use crate::signs::{length_costs, limb_depths};
}
