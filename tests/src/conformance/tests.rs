use std::path::PathBuf;

use super::*;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Members whose lists of numbers end in value and tolerance.
const MEASURED: [&str; 12] = [
    "pixels",
    "sum",
    "max",
    "force_n",
    "summary",
    "points",
    "actuators",
    "touch",
    "pressure_sum",
    "torque_n_m",
    "centre",
    "error_estimate",
];

/// Compares recorded numbers; returns how many there were.
fn compare(path: &str, measured: bool, found: &Value, due: &Value) -> usize {
    match (found, due) {
        (Value::Object(found), Value::Object(due)) => {
            assert!(found.keys().eq(due.keys()), "{path}: other members");
            let of = |(name, value): (&String, &Value)| {
                // Inputs have members of the same names.
                let expected = path.contains(".expect") && MEASURED.contains(&name.as_str());
                let measured = measured || expected;
                compare(&format!("{path}.{name}"), measured, value, &due[name])
            };
            found.iter().map(of).sum()
        }
        (Value::Array(found), Value::Array(due)) => {
            assert_eq!(found.len(), due.len(), "{path}: another length");
            if !measured || found.iter().any(|part| part.is_array() || part.is_null()) {
                let parts = found.iter().zip(due).enumerate();
                return parts
                    .map(|(i, (f, d))| compare(&format!("{path}[{i}]"), measured, f, d))
                    .sum();
            }
            let number = |of: &Value| of.as_f64().unwrap_or_else(|| panic!("{path}: no number"));
            let (value, tolerance) = (found.len() - 2, found.len() - 1);
            let off = (number(&found[value]) - number(&due[value])).abs();
            // A tenth: what clients are allowed has to cover their own rounding.
            assert!(
                off <= 0.1 * number(&found[tolerance]) + 1e-6,
                "{path}: {found:?}, due {due:?}"
            );
            assert!(number(&found[tolerance]) <= 1.2 * number(&due[tolerance]) + 1e-9, "{path}");
            assert_eq!(found[..value], due[..value], "{path}");
            1
        }
        _ => {
            assert_eq!(found, due, "{path}");
            0
        }
    }
}

#[test]
fn the_committed_scripts_are_what_engine_and_formulas_say() {
    committed_is_recorded("proto/conformance.json", 250);
    committed_is_recorded("proto/conformance-moving.json", 60);
    committed_is_recorded("proto/conformance-fingers.json", 10);
}

fn committed_is_recorded(path: &str, least: usize) {
    let text = fs::read_to_string(root().join(path)).unwrap();
    let committed: Value = serde_json::from_str(&text).unwrap();
    let mut recorded = committed.clone();
    Recorder::new(&root().join("models")).unwrap().fill(&mut recorded).unwrap();
    let numbers = compare("", false, &committed, &recorded);
    assert!(numbers > least, "only {numbers} numbers are expected in {path}");
    assert_eq!(print(&committed), text, "not as `conformance-record` prints it");
}

#[test]
fn the_committed_contact_script_is_what_the_solver_says() {
    let text = fs::read_to_string(root().join("proto/conformance-contact.json")).unwrap();
    let committed: Value = serde_json::from_str(&text).unwrap();
    let mut recorded = committed.clone();
    let recorder = ContactRecorder::new(&root().join("models")).unwrap();
    recorder.fill(&mut recorded).unwrap();
    let numbers = compare("", false, &committed, &recorded);
    assert!(numbers > 200, "only {numbers} numbers are expected in the whole script");
    assert_eq!(print(&committed), text, "not as `conformance-record` prints it");
    assert!(recorder.file().starts_with(b"papilla contact model"));
}

#[test]
fn a_map_on_a_limit_is_refused() {
    let mut file = serde_json::json!({"cases": [{"name": "limit", "steps": [
        {"do": "hello", "hello": {"tier": "half-space"}},
        {"do": "frame", "pressure": {"disc": [100.5, 100.5, 4.0, 5000.0]}, "expect": {}},
    ]}]});
    let error = Recorder::new(&root().join("models")).unwrap().fill(&mut file).unwrap_err();
    assert!(error.to_string().contains("case limit, step 1"), "{error}");
}
