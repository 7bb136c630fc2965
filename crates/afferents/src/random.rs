//! Numbers that depend on what they are for alone: not on how many were drawn before.

/// 64 bits that the words decide (splitmix64, Steele, Lea & Flood 2014, over each word in turn).
pub(crate) fn mixed(words: [u64; 4]) -> u64 {
    words.into_iter().fold(0, |state, word| {
        let mut z = (state ^ word).wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    })
}

/// A number of mean 0 and variance 1: four uniform ones together. The membrane adds up many, so
/// that its voltage is normal.
pub(crate) fn normal(seed: u32, unit: usize, sample: u64) -> f64 {
    let bits = mixed([u64::from(seed), 3, unit as u64, sample]);
    let sum: u64 = (0..4).map(|part| bits >> (16 * part) & 0xffff).sum();
    // Each is uniform on 0..=65535; of their sum the mean is 131070, the variance a third of 65536^2.
    (sum as f64 - 131_070.0) * (3_f64.sqrt() / 65_536.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_and_variance_and_do_not_follow_each_other() {
        let count = 100_000;
        let of: Vec<f64> = (0..count).map(|sample| normal(5, 17, sample)).collect();
        let mean = of.iter().sum::<f64>() / count as f64;
        let variance = of.iter().map(|x| x * x).sum::<f64>() / count as f64;
        let next = of.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / count as f64;
        // Five standard deviations of each estimate.
        assert!(mean.abs() < 0.016, "{mean}");
        assert!((variance - 1.0).abs() < 0.022, "{variance}");
        assert!(next.abs() < 0.016, "{next}");
    }
}
