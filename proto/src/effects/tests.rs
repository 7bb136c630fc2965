use serde_json::json;

use super::*;

#[test]
fn names_read_back_and_are_those_of_the_json() {
    for effect in RuntimeEffect::ALL {
        assert_eq!(effect.as_str().parse(), Ok(effect));
        assert_eq!(serde_json::to_value(effect).unwrap(), effect.as_str());
    }
    assert_eq!("friction".parse::<RuntimeEffect>(), Err(()));
}

#[test]
fn parameters_left_out_have_their_default_and_misspelt_ones_are_refused() {
    assert_eq!(
        serde_json::from_value::<Afferents>(json!({"theta_kpa": 5.0})).unwrap(),
        Afferents { theta_kpa: 5.0, ..Afferents::default() }
    );
    assert_eq!(serde_json::from_value::<Relaxation>(json!({})).unwrap(), Relaxation::default());
    let layout: Layout = serde_json::from_value(json!({
        "radius_mm": 1.0, "gain": 0.01,
        "actuators": [{"at": {"px": [10.5, 20.5]}}, {"at": {"mm": [3, 0, -5]}, "gain": 2.0}]
    }))
    .unwrap();
    assert_eq!(layout.actuators[0].at, Place::Px([10.5, 20.5]));
    assert_eq!((layout.actuators[1].gain, layout.max), (Some(2.0), 1.0));
    assert!(serde_json::from_value::<Afferents>(json!({"theta": 5.0})).is_err());
    assert!(serde_json::from_value::<Layout>(json!({"actuators": [{"at": [1, 2]}]})).is_err());
    assert!(serde_json::from_value::<Layout>(json!({"radius_mm": 1.0})).is_err());
    assert!(serde_json::from_value::<Relaxation>(json!({"tissue": "nail"})).is_err());
}

#[test]
fn an_unknown_effect_is_told_with_all_that_there_are_and_the_nearest() {
    let rendered = ["layers".to_owned(), "finite_strain".to_owned()];
    let told = |effect: &str| unknown_effect(effect, Some(("small", &rendered)));
    for (effect, meant) in [
        ("sumary", "was 'summary' meant?"),
        ("layer", "was 'layers' meant?"),
        ("finite-strian", "was 'finite_strain' meant?"),
    ] {
        let problem = told(effect);
        assert_eq!(problem.code, ErrorCode::UnknownEffect);
        assert_eq!(problem.field.as_deref(), Some("effects"));
        assert!(problem.message.contains(meant), "{}", problem.message);
        let sessions = RuntimeEffect::ALL.map(RuntimeEffect::as_str);
        for known in sessions.into_iter().chain(rendered.iter().map(String::as_str)) {
            assert!(problem.message.contains(known), "{} lacks {known}", problem.message);
        }
    }
    assert!(!told("sound").message.contains("meant"));
    let alone = unknown_effect("spike", None).message;
    assert!(alone.contains("was 'spikes' meant?") && !alone.contains("tier"), "{alone}");
}
