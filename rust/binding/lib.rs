//! `pegbar._kernels`: registers the wrappers; each file carries its kernel's name.

mod arrays;
mod color;
mod composite;
mod depth;
mod errors;
mod holdout;

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
    use crate::holdout::matte;
}
