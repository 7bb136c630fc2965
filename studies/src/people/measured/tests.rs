//! What is read, and what is refused.

use super::*;

#[test]
fn what_is_shipped_is_read() {
    let measured = Measured::shipped().unwrap();
    assert!(measured.figures.len() >= 24);
    assert_eq!(measured.sa1.rate_per_s.len(), 3);
}

#[test]
fn bad_measurements_are_refused_by_field() {
    for (from, to, field) in [
        ("[0.098, 0.147", "[0.147, 0.098", "sa1.force_n"),
        ("[21.3, 29.4,", "[21.3,", "sa1.rate_per_s[0]"),
        ("[25.2, ", "[-25.2, ", "sa1.rate_per_s[1]"),
        ("80.6, 172.0", "80600.0, 172.0", "sa1.curvature_per_m[1]"),
        ("range = [0.07, 0.2]", "range = [0.2, 0.07]", "figure[11].range"),
        ("value = 3.5", "value = -3.5", "figure[0]"),
        ("value = 3.5", "value = 3.5\nat_most = 4.0", "figure[0]"),
        ("depth_mm = 2.0", "depth_mm = 200.0", "figure[17].quantity.depth_mm"),
        ("from_n = 1.0, to_n = 4.0", "from_n = 5.0, to_n = 4.0", "figure[2].quantity.from_n"),
    ] {
        let text = SHIPPED.replacen(from, to, 1);
        assert_ne!(text, SHIPPED, "{from}");
        let error = Measured::parse("m.toml".as_ref(), &text).unwrap_err();
        let PeopleError::Field { field: found, .. } = &error else { panic!("{error}") };
        assert_eq!(found, field, "{error}");
    }
}

#[test]
fn unknown_words_are_refused_with_their_line() {
    let text = SHIPPED.replacen("second_hand = true", "third_hand = true", 1);
    let error = Measured::parse("m.toml".as_ref(), &text).unwrap_err().to_string();
    assert!(error.contains("m.toml") && error.contains("third_hand"), "{error}");
}
