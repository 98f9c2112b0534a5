//! The pure kernels of pegbar, one file each, without Python. This file names the modules and defines nothing.

pub mod color;
pub mod composite;
pub mod composite_block;
pub mod depth;
pub mod error;
pub mod grow;
pub mod matte;
pub mod palette;
pub mod segment;
mod settle;
