//! Chance without a state: numbers that hang on a serial number and on what they are for (splitmix64, Steele et al. 2014).

/// The finaliser of splitmix64.
pub fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    value ^ (value >> 31)
}

/// A number from 0 to 1 that hangs on a serial number and on what it is for.
pub fn chance(serial: u64, purpose: u64) -> f64 {
    (mix(serial ^ mix(purpose)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_evenly_and_differ_by_purpose() {
        let numbers: Vec<f64> = (0..4000).map(|serial| chance(serial, 7)).collect();
        let mean = numbers.iter().sum::<f64>() / 4000.0;
        assert!((mean - 0.5).abs() < 0.02 && numbers.iter().all(|number| (0.0..1.0).contains(number)), "{mean}");
        assert!(numbers[..9] != (0..9).map(|serial| chance(serial, 8)).collect::<Vec<_>>()[..]);
        // The generator's first output for seed 0, as published with it.
        assert_eq!(mix(0), 0xE220_A839_7B1D_CDAF);
    }
}
