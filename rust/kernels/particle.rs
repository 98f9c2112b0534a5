//! One particle: where it is, how it goes, what it is, and the rows of numbers that hold it between frames.

use glam::DVec3;

/// What a slot holds.
pub mod phase {
    /// Nothing.
    pub const FREE: i64 = 0;
    /// A flake or drop in the air that has touched nothing.
    pub const FALLING: i64 = 1;
    /// A flake that lies on something.
    pub const SETTLED: i64 = 2;
    /// A droplet of a splash.
    pub const DROPLET: i64 = 3;
    /// What has touched something and runs or falls off it.
    pub const SLIDING: i64 = 4;
}

/// One particle.
#[derive(Debug, Clone, Copy)]
pub struct Particle {
    /// World metres.
    pub place: DVec3,
    /// m/s.
    pub speed: DVec3,
    /// Metres.
    pub radius: f64,
    /// Seconds in its phase.
    pub age: f64,
    /// What chance hangs on.
    pub serial: u64,
    /// Index of the limb, then of the triangle that it lies on.
    pub host: i64,
    /// What its slot holds.
    pub phase: i64,
}

impl Particle {
    /// Of a row of motion and one of codes.
    pub fn of(row: &[f64; 8], code: &[i64; 3]) -> Self {
        let (place, speed) = (DVec3::new(row[0], row[1], row[2]), DVec3::new(row[3], row[4], row[5]));
        let [serial, host, phase] = *code;
        Particle { place, speed, radius: row[6], age: row[7], serial: serial as u64, host, phase }
    }

    /// Its row of motion and its row of codes.
    pub fn rows(&self) -> ([f64; 8], [i64; 3]) {
        let ([x, y, z], [u, v, w]) = (self.place.to_array(), self.speed.to_array());
        ([x, y, z, u, v, w, self.radius, self.age], [self.serial as i64, self.host, self.phase])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_went_in() {
        let (row, code) = ([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], [-9, 4, phase::SLIDING]);
        assert_eq!(Particle::of(&row, &code).rows(), (row, code));
    }
}
