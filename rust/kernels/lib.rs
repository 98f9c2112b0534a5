//! The pure kernels of pegbar, one file each, without Python. This file names the modules and defines nothing.

pub mod checks;
pub mod color;
pub mod composite;
pub mod composite_block;
pub mod depth;
pub mod error;
pub mod holdout;
