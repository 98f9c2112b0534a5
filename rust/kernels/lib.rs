//! The pure kernels of pegbar, one file each, without Python. This file names the modules and defines nothing.

pub mod band;
pub mod checks;
pub mod clip;
pub mod color;
pub mod composite;
pub mod composite_block;
pub mod depth;
pub mod error;
pub mod fill;
pub mod grow;
pub mod holdout;
pub mod ink;
pub mod lift;
pub mod matte;
pub mod paint;
pub mod palette;
pub mod raster;
pub mod resolve;
pub mod rim;
pub mod segment;
mod settle;
pub mod shade;
pub mod signs;
pub mod surface;
