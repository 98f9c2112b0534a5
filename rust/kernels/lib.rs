//! The pure kernels of pegbar, one file each, without Python. This file names the modules and defines nothing.

pub mod band;
pub mod clip;
pub mod depth;
pub mod error;
pub mod ink;
pub mod paint;
pub mod raster;
pub mod resolve;
pub mod shade;
pub mod surface;
