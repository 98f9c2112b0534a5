//! A cloth and what acts on it, as `cloth.rs` and `contact.rs` take them.

use glam::DVec3;

/// A cloth as it is made.
#[derive(Debug, Clone, Copy)]
pub struct Sheet<'a> {
    /// 1/kg by vertex, 0 where it is pinned.
    pub weights: &'a [f64],
    /// Corners of the triangles: where air presses.
    pub triangles: &'a [[u32; 3]],
    /// Pairs of vertices at a distance, in the order they are solved, the one nearer to a pin first.
    pub links: &'a [[u32; 2]],
    /// Metres by link.
    pub lengths: &'a [f64],
    /// Pairs of vertices that face each other across a fold.
    pub folds: &'a [[u32; 2]],
    /// Metres by fold.
    pub spans: &'a [f64],
    /// A vertex and the pinned vertex it hangs from.
    pub tethers: &'a [[u32; 2]],
    /// Metres of cloth between the two.
    pub reaches: &'a [f64],
    /// Pairs of vertices some links apart on the way from a pin: they carry pulls farther than one link in one go.
    pub stays: &'a [[u32; 2]],
    /// Metres of cloth between them, which they may not exceed.
    pub spread: &'a [f64],
    /// Metres per newton by which links and folds give way.
    pub compliances: [f64; 2],
}

/// What acts on it.
#[derive(Debug, Clone, Copy)]
pub struct Forces<'a> {
    /// Seconds of a substep.
    pub step: f64,
    /// m/s^2.
    pub gravity: DVec3,
    /// The air's velocity by vertex.
    pub air: &'a [DVec3],
    /// How strongly air holds the cloth, 1 a plate of its size.
    pub drag: f64,
    /// Rate in 1/s at which motion dies.
    pub damping: f64,
    /// Metres kept clear of volumes and ground.
    pub thickness: f64,
    /// Of volumes and ground.
    pub friction: f64,
    /// Height of the ground, -inf for none.
    pub ground: f64,
}
