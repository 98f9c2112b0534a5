//! `pegbar._kernels`: registers the wrappers; each file carries its kernel's name.

mod arrays;
mod depth;
mod errors;
mod paint;
mod raster;

use pyo3::prelude::*;

/// The Rust kernels of pegbar. Strict and private: call the functions of the `pegbar` package instead.
#[pymodule(gil_used = false)]
mod _kernels {
    #[pymodule_export]
    use crate::depth::limb_depth;
    #[pymodule_export]
    use crate::paint::{fill_polygon, stroke_polyline, unpremultiply};
    #[pymodule_export]
    use crate::raster::{render_passes, resolve_passes};
}
