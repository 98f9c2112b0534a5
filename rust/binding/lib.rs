//! `pegbar._kernels`: registers the wrappers; each file carries its kernel's name.

mod arrays;
mod depth;
mod errors;
mod grow;
mod matte;
mod palette;
mod segment;

use pyo3::prelude::*;

/// The Rust kernels of pegbar. Strict and private: call the functions of the `pegbar` package instead.
#[pymodule(gil_used = false)]
mod _kernels {
    #[pymodule_export]
    use crate::depth::limb_depth;
    #[pymodule_export]
    use crate::grow::grow_labels;
    #[pymodule_export]
    use crate::matte::{fill_matte, has_alpha, ink_alpha, matte};
    #[pymodule_export]
    use crate::palette::palette_labels;
    #[pymodule_export]
    use crate::segment::segment_stick_figure;
}
