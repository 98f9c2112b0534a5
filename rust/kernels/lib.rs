//! The pure kernels of pegbar, one file each, without Python. This file names the modules and defines nothing.

pub mod depth;
pub mod error;
pub mod paint;
