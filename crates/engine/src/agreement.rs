//! How close an answer is to the truth. All slices have the length of the mask.

/// Relative L2 error `|found - due| / |due|` over the pixels of the mask; 0 if both are zero there.
#[must_use]
pub fn relative_l2(found: &[f32], due: &[f32], mask: &[bool]) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for ((found, due), _) in found.iter().zip(due).zip(mask).filter(|(_, inside)| **inside) {
        difference += f64::from(found - due).powi(2);
        size += f64::from(*due).powi(2);
    }
    if difference > 0.0 { (difference / size.max(f64::MIN_POSITIVE)).sqrt() } else { 0.0 }
}

/// `sum found due / sum due^2` over the pixels of the mask: the part of the true map `due` that
/// `found` holds. 1 if `due` is zero there.
#[must_use]
pub fn share(found: &[f32], due: &[f32], mask: &[bool]) -> f64 {
    let (mut common, mut size) = (0.0, 0.0);
    for ((&found, &due), _) in found.iter().zip(due).zip(mask).filter(|(_, inside)| **inside) {
        common += f64::from(found) * f64::from(due);
        size += f64::from(due).powi(2);
    }
    if size > 0.0 { common / size } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_a_multiple_is_its_factor() {
        let (due, mask) = ([6.0, 8.0, 5.0], [true, true, false]);
        for factor in [0.0, 0.001, 0.5, 1.0, 2.0] {
            let found = due.map(|due| factor * due);
            assert!((share(&found, &due, &mask) - f64::from(factor)).abs() < 1e-7);
        }
        assert!((share(&[8.0, -6.0, 9.0], &due, &mask)).abs() < 1e-12, "nothing in common");
        assert!((share(&[1.0; 3], &[0.0; 3], &mask) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_error_is_relative_and_of_the_patch_alone() {
        let mask = [true, true, false];
        assert!((relative_l2(&[3.0, 4.0, 9.0], &[6.0, 8.0, 0.0], &mask) - 0.5).abs() < 1e-12);
        assert!(relative_l2(&[0.0; 3], &[0.0; 3], &mask).abs() < 1e-12);
        assert!(relative_l2(&[1.0, 0.0, 0.0], &[0.0; 3], &mask) > 1e100);
    }
}
