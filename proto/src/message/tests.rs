use proptest::prelude::*;
use serde_json::json;

use super::*;

#[test]
fn the_smallest_hello_is_enough() {
    for smallest in [json!({"type": "hello"}), json!({"type": "hello", "version": 3})] {
        let due = ClientMessage::Hello(Hello::default());
        assert_eq!(read(&smallest), Ok(due.clone()));
        assert_eq!(serde_json::from_value::<ClientMessage>(smallest).unwrap(), due);
    }
}

#[test]
fn no_other_version_is_spoken() {
    assert!(Hello::default().check_version().is_ok());
    for version in [0, 1, 2, 4, u32::MAX] {
        let problem = Hello { version, ..Hello::default() }.check_version().unwrap_err();
        assert_eq!(problem.code, ErrorCode::UnknownVersion);
        assert_eq!(problem.field.as_deref(), Some("version"));
        assert!(problem.message.contains("name 3"), "{problem}");
    }
}

#[test]
fn a_hello_without_a_wish_is_short() {
    let json = serde_json::to_value(Hello::default()).unwrap();
    let names: Vec<_> = json.as_object().unwrap().keys().cloned().collect();
    let due = ["atlas_hash", "budget_us", "effects", "pressure_scale_pa", "sample_type"];
    assert_eq!(names, [&due[..], &["tier", "version"]].concat());
}

#[test]
fn a_session_that_moves_says_so_in_words() {
    let seal = ClientMessage::from_json(br#"{"type":"seal"}"#);
    assert_eq!(seal, Ok(ClientMessage::Seal));
    let ask = Reconnect { reason: ReconnectReason::Drain, within_ms: Some(10_000) };
    assert_eq!(
        serde_json::to_value(ServerMessage::Reconnect(ask)).unwrap(),
        json!({"type": "reconnect", "reason": "drain", "within_ms": 10_000})
    );
}

#[test]
fn misspelt_and_mistyped_members_are_refused() {
    for bad in [
        json!({"type": "hello", "teir": "x"}),
        json!({"type": "helo"}),
        json!({"version": 3}),
        json!({"type": "hello", "sample_type": "f64"}),
        json!({"type": "hello", "budget_us": -1}),
        json!({"type": "hello", "budget_us": 1.5}),
        json!({"type": "hello", "version": "3"}),
        json!({"type": "hello", "version": null}),
        json!([]),
    ] {
        assert!(serde_json::from_value::<ClientMessage>(bad.clone()).is_err(), "{bad}");
        assert!(read(&bad).is_err(), "{bad}");
    }
}

#[test]
fn an_error_says_whether_the_session_goes_on() {
    let problem = Problem::new(ErrorCode::WrongLength, "short").at("payload");
    let message = ServerMessage::Error(SessionError::new(problem, Some(4), false));
    assert_eq!(
        serde_json::to_value(&message).unwrap(),
        json!({"type": "error", "code": "wrong_length", "message": "short",
               "field": "payload", "sequence": 4, "closes": false})
    );
}

proptest! {
    #[test]
    fn hellos_come_back(
        effects in prop::collection::vec("[a-z_]{1,12}", 0..4),
        budget_us in any::<Option<u32>>(),
        tier in prop::option::of(".{0,20}"),
        kind in 0u8..4,
        scale in prop::option::of(1e-6f32..1e6),
    ) {
        let hello = ClientMessage::Hello(Hello {
            effects,
            budget_us,
            tier,
            sample_type: SampleType::from_wire(kind).unwrap(),
            pressure_scale_pa: scale,
            ..Hello::default()
        });
        let text = serde_json::to_string(&hello).unwrap();
        prop_assert_eq!(&serde_json::from_str::<ClientMessage>(&text).unwrap(), &hello);
        prop_assert_eq!(ClientMessage::from_json(text.as_bytes()), Ok(hello));
    }

    #[test]
    fn text_of_any_kind_does_not_panic(text in ".{0,200}") {
        let _ = serde_json::from_str::<ClientMessage>(&text);
        let _ = ClientMessage::from_json(text.as_bytes());
        let _ = serde_json::from_str::<ServerMessage>(&text);
    }
}

fn read(json: &serde_json::Value) -> Result<ClientMessage, MessageError> {
    ClientMessage::from_json(json.to_string().as_bytes())
}

#[test]
fn what_is_wrong_with_a_hello_is_said_with_member_and_place() {
    let with = |members: &str| format!(r#"{{"type":"hello","version":3,{members}}}"#);
    for (text, member, words) in [
        (r#"{"type":"hello","version":"3"}"#.to_owned(), Some("version"), "line 1, column 29"),
        (with(r#""budget_us":-1"#), Some("budget_us"), "invalid value: integer `-1`"),
        (
            with(r#""effects":["a",7]"#),
            Some("effects[1]"),
            "invalid type: integer `7`, expected a string",
        ),
        (with(r#""teir":"x""#), None, "unknown field `teir`"),
        (
            with(r#""actuators":{"actuators":[{"at":{"px":[1]}}]}"#),
            Some("actuators.actuators[0].at.px"),
            "invalid length 1",
        ),
        (with(r#""points":[{"inch":[1]}]"#), Some("points[0]"), "`inch`"),
    ] {
        let error = ClientMessage::from_json(text.as_bytes()).unwrap_err();
        assert!(matches!(error, MessageError::Hello(_)), "{text}: {error:?}");
        assert!(error.to_string().contains(words), "{text}: {error}");
        assert_eq!(error.json().member.as_deref(), member, "{text}: {error}");
    }
    let long = json!({"type": "hello", "tier": "x".repeat(2000)});
    let large = json!({"type": "hello", "effects": vec![""; 1 << 18]});
    for text in [
        large.to_string(),
        "?".to_owned(),
        r#"{"type":"helo"}"#.to_owned(),
        "[]".to_owned(),
        long.to_string(),
    ] {
        let error = ClientMessage::from_json(text.as_bytes()).unwrap_err();
        assert!(matches!(error, MessageError::Unknown(_)), "{error:?}");
    }
}

#[test]
fn the_type_may_stand_anywhere() {
    for text in [r#"{"type":"hello","version":3}"#, r#"{"version":3,"type":"hello"}"#] {
        let hello = ClientMessage::from_json(text.as_bytes());
        assert_eq!(hello, Ok(ClientMessage::Hello(Hello::default())));
    }
}
