//! The pure kernels of pegbar, one file each, without Python. This file names the modules and defines nothing.

pub mod depth;
pub mod error;
pub mod fill;
pub mod grow;
pub mod matte;
pub mod palette;
pub mod segment;
mod settle;
