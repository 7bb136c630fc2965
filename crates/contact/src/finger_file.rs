//! From which description of a finger a contact model was made.

use sha2::{Digest, Sha256};
use toml::{Table, Value};

/// The table that says where a finger is from; no number depends on it.
const SOURCE: &str = "source";
/// Where the name of the skin's file stands.
const SKIN: [&str; 2] = ["shape", "skin"];

/// A description of a finger that cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(transparent)]
pub struct FingerFileError(#[from] toml::de::Error);

/// Hash of a finger's description, hexadecimal: of the keys and values of its `finger.toml`, and of
/// the file of its skin's offset if it names one. Comments, spaces, the order of keys and the table
/// `source` do not change it. An integer counts as the same number with a decimal point.
///
/// `skin` is given the name of that file and returns its bytes, or none if there is no such file.
///
/// # Errors
/// The text is no TOML.
pub fn finger_file_sha256(
    text: &str,
    skin: impl FnOnce(&str) -> Option<Vec<u8>>,
) -> Result<String, FingerFileError> {
    let mut table: Table = toml::from_str(text)?;
    table.remove(SOURCE);
    let mut hash = Sha256::new();
    hash.update(canonical(&Value::Table(table.clone())));
    let name = table.get(SKIN[0]).and_then(|shape| shape.get(SKIN[1])).and_then(Value::as_str);
    if let Some(bytes) = name.and_then(skin) {
        hash.update(bytes);
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// A value as text; tables by the order of their keys.
fn canonical(value: &Value) -> String {
    match value {
        Value::Integer(number) => format!("{:?}", *number as f64),
        Value::Float(number) => format!("{number:?}"),
        Value::Array(values) => {
            format!("[{}]", values.iter().map(canonical).collect::<Vec<_>>().join(","))
        }
        Value::Table(table) => {
            let mut keys: Vec<_> = table.iter().collect();
            keys.sort_unstable_by_key(|(key, _)| *key);
            let pair = |(key, value): (&String, &Value)| format!("{key:?}:{}", canonical(value));
            format!("{{{}}}", keys.into_iter().map(pair).collect::<Vec<_>>().join(","))
        }
        other => format!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::finger_file_sha256;

    fn hash(text: &str) -> String {
        finger_file_sha256(text, |_| Some(b"skin".to_vec())).unwrap()
    }

    #[test]
    fn what_no_number_depends_on_does_not_change_it() {
        let plain = hash("[shape]\nwidth_mm = 17\nlength_mm = 25.0\n[bone]\ntip_mm = [1, 2.0]\n");
        let same = "# a child's\n[source]\nwho = \"x\"\n[bone]\ntip_mm = [1.0, 2]\n\
            [shape]\nlength_mm = 25 # long\nwidth_mm = 17.0\n";
        assert_eq!(plain, hash(same));
    }

    #[test]
    fn each_value_changes_it() {
        let text = "[shape]\nskin = \"skin.json\"\nwidth_mm = 17.0\n";
        let others = [
            text.replace("17.0", "17.5"),
            text.replace("width_mm", "height_mm"),
            text.replace("shape", "nail"),
            format!("{text}[tissue.dermis]\nyoungs_modulus_mpa = 0.1\n"),
        ];
        for other in others {
            assert_ne!(hash(text), hash(&other), "{other}");
        }
        let without = |_: &str| None;
        let asked = finger_file_sha256(text, |name| Some(name.as_bytes().to_vec())).unwrap();
        assert_ne!(asked, finger_file_sha256(text, without).unwrap());
        assert!(finger_file_sha256("[shape", without).is_err());
    }
}
