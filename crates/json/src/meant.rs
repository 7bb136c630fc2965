//! What a misspelt name was probably meant to be.

/// Of a name, one letter in so many may be wrong; one may always be.
const LETTERS: usize = 3;

/// Words that ask whether the known name nearest to `name` was meant, as ` (was 'friction' meant?)`; empty
/// if none is near.
///
/// ```
/// let effects = ["friction", "layers"];
/// assert_eq!(papilla_json::meant("frictoin", effects), " (was 'friction' meant?)");
/// assert_eq!(papilla_json::meant("sound", effects), "");
/// ```
#[must_use]
pub fn meant<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, known).map_or_else(String::new, |near| format!(" (was '{near}' meant?)"))
}

/// The known name nearest to `name`, if a few letters are wrong, missing or changed over; the first of
/// several that are as near. Capitals do not matter, nor whether words are joined by `_`, `-` or a space.
#[must_use]
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace(['-', ' '], "_");
    let own = plain(name);
    let wrong_max = (own.chars().count() / LETTERS).max(1);
    let wrong = |known: &str| strsim::damerau_levenshtein(&own, &plain(known));
    // A name from outside may be as long as it likes, and the effort is that of both lengths.
    let alike = |known: &&str| known.len().abs_diff(own.len()) <= wrong_max;
    let counted = known.into_iter().filter(alike).map(|known| (wrong(known), known));
    let (least, near) = counted.min_by_key(|(wrong, _)| *wrong)?;
    (least <= wrong_max).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_and_a_far_one_is_not() {
        let known = ["summary", "points", "spikes", "shear_energy", "contact_window"];
        for (name, due) in [
            ("sumary", Some("summary")),
            ("Summary", Some("summary")),
            ("point", Some("points")),
            ("psikes", Some("spikes")),
            ("shear-energy", Some("shear_energy")),
            ("ShearEnergy", Some("shear_energy")),
            ("contact window", Some("contact_window")),
            ("spots", None),
            ("pot", None),
            ("", None),
            ("friction", None),
        ] {
            assert_eq!(nearest(name, known), due, "{name}");
        }
        assert_eq!(nearest(&"s".repeat(1 << 20), known), None);
        assert_eq!(nearest("abd", ["abc", "abe"]), Some("abc"));
        assert_eq!(nearest("abd", []), None);
    }
}
