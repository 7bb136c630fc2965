use std::collections::BTreeMap;

use proptest::prelude::*;
use serde::Deserialize;

use super::*;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code, reason = "only read")]
struct Outer {
    count: u32,
    #[serde(default)]
    inner: Vec<Inner>,
    #[serde(default)]
    is_on: bool,
    #[serde(default)]
    pair: [f32; 2],
    #[serde(default)]
    kind: Kind,
}

#[derive(Debug, Deserialize)]
#[allow(dead_code, reason = "only read")]
struct Inner {
    length_mm: f64,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    #[default]
    Soft,
    Hard,
}

fn refused(json: &str) -> String {
    read::<Outer>(json.as_bytes()).unwrap_err().to_string()
}

#[test]
fn a_wrong_type_names_member_and_place() {
    for (json, member, words, place) in [
        (r#"{"count": "1"}"#, Some("count"), "expected u32", (1, 13)),
        (r#"{"count": -1}"#, Some("count"), "expected u32", (1, 12)),
        (
            "{\"count\": 1,\n \"inner\": [{\"length_mm\": 1}, {\"length_mm\": [2]}]}",
            Some("inner[1].length_mm"),
            "expected f64",
            (2, 43),
        ),
        (r#"{"count": 1, "inner": [7]}"#, Some("inner[0]"), "integer `7`", (1, 24)),
        (r#"{"count": 1, "is_on": 1}"#, Some("is_on"), "expected a boolean", (1, 23)),
        (r#"{"count": 1, "pair": [1]}"#, Some("pair"), "length 1", (1, 24)),
        ("5", None, "integer `5`", (1, 1)),
    ] {
        let error = read::<Outer>(json.as_bytes()).unwrap_err();
        assert_eq!((error.member.as_deref(), error.place), (member, Some(place)), "{error}");
        assert!(error.reason.contains(words), "{error}");
        let said = serde_json::from_str::<Outer>(json).unwrap_err().to_string();
        assert!(said.starts_with(&error.reason), "serde says {said}, we {error}");
    }
    assert!(refused(r#"{"count": 1, "cuont": 2}"#).contains("unknown field `cuont`"));
}

#[test]
fn a_byte_order_mark_is_passed_over_and_utf_16_is_named() {
    let json = "{\"count\": 1}";
    let marked = format!("\u{feff}{json}");
    assert_eq!(read::<Outer>(marked.as_bytes()).unwrap().count, 1);
    assert_eq!(read_bounded::<Outer>(marked.as_bytes()).unwrap().count, 1);
    // Places are those that an editor shows.
    let wrong = read::<Outer>("\u{feff}{\"count\": -1}".as_bytes()).unwrap_err();
    assert_eq!(wrong.place, Some((1, 12)));
    let wide: Vec<u8> = marked.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for json in [&wide[..], &wide[2..]] {
        let error = read_bounded::<Outer>(json).unwrap_err().to_string();
        assert!(error.contains("UTF-16") && error.contains("UTF-8"), "{error}");
    }
}

#[test]
fn long_texts_are_not_repeated() {
    let long = format!(r#"{{"count": "{}"}}"#, "x".repeat(5000));
    assert!(refused(&long).len() < 300, "{}", refused(&long));
    let long = format!(r#"{{"count": 1, "{}": 1}}"#, "x".repeat(5000));
    assert!(refused(&long).len() < 300, "{}", refused(&long));
}

#[test]
fn a_text_that_is_too_long_is_refused_before_it_is_read() {
    let text = |length: usize, escapes: &str| {
        format!("{{\"a\":\n \"{}{escapes}\"}}", "x".repeat(length - escapes.len()))
    };
    let read = |json: &str| read_bounded::<BTreeMap<String, String>>(json.as_bytes());
    for escapes in ["", r"\\", r#"\""#] {
        assert!(read(&text(TEXT_BYTES_MAX, escapes)).is_ok());
        let error = read(&text(TEXT_BYTES_MAX + 1, escapes)).unwrap_err();
        assert_eq!((error.member, error.place), (None, Some((2, 2))), "{}", error.reason);
    }
    // One that never ends.
    assert!(read(&format!("{{\"{}", "x".repeat(2000))).unwrap_err().reason.contains("longer"));
}

proptest! {
    #[test]
    fn bytes_of_any_kind_do_not_panic(json in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = read_bounded::<Outer>(&json);
    }

    #[test]
    fn the_longest_text_is_found(parts in prop::collection::vec("[a\"\\\\]{0,6}", 0..8)) {
        let json = serde_json::to_string(&parts).unwrap();
        prop_assert_eq!(read_bounded::<Vec<String>>(json.as_bytes()).unwrap(), parts);
    }
}

#[test]
fn what_is_repeated_is_cut_between_characters() {
    assert_eq!(shortened("naïve"), "naïve");
    let long = shortened(&"ï".repeat(500));
    assert_eq!((long.chars().count(), long.chars().last()), (ECHO_MAX + 1, Some('…')));
}

#[test]
fn of_an_unknown_name_all_that_are_known_are_listed() {
    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Many {
        APlateWithRoundedEdges,
        ACylinderThatLiesAlongY,
        AWedgeWithARoundedTip,
        ASurfaceOfListedHeights,
        AClosedMeshOfTriangles,
        SeveralOfThemAsOne,
    }
    let error = super::read::<Many>(format!("\"{}\"", "x".repeat(400)).as_bytes());
    let error = error.unwrap_err().to_string();
    for name in
        ["a_plate_with_rounded_edges", "a_closed_mesh_of_triangles", "several_of_them_as_one"]
    {
        assert!(error.contains(name), "{error}");
    }
    assert!(error.len() < 450, "what was sent is cut: {error}");
}
