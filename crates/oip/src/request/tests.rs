use proptest::prelude::*;
use serde_json::json;

use papilla_proto::MAP_LEN;
use serde_json::Value;

use super::*;

fn input(members: &Value) -> Value {
    let mut input = json!({"name": "pressure_pa", "shape": SHAPE, "datatype": "FP32"});
    for (name, value) in members.as_object().unwrap() {
        input[name] = value.clone();
    }
    json!({"inputs": [input]})
}

fn read_json(request: &Value) -> Result<Request, (ErrorCode, Option<String>)> {
    Request::read(&Bytes::from(request.to_string()), None).map_err(|p| (p.code, p.field))
}

#[test]
fn flat_and_nested_numbers_are_the_same_map() {
    let flat: Vec<usize> = (0..MAP_LEN).collect();
    let rows: Vec<_> = flat.chunks(224).map(<[usize]>::to_vec).collect();
    let a = read_json(&input(&json!({"data": flat}))).unwrap();
    let b = read_json(&input(&json!({"data": [[rows]]}))).unwrap();
    assert_eq!((&a.id, a.is_binary_wanted, a.timeout_us), (&None, false, None));
    assert!(a == b && a.pressure_pa.len() == MAP_LEN * 4);
    assert_eq!(&a.pressure_pa[4 * 300..4 * 301], 300.0_f32.to_le_bytes());
}

#[test]
fn what_the_client_wants_of_its_answer() {
    let data = vec![0; MAP_LEN];
    let mut request = input(&json!({"data": data}));
    request["id"] = json!("seven");
    request["parameters"] = json!({"binary_data_output": true, "timeout": 900});
    let read = read_json(&request).unwrap();
    assert_eq!(read.id.as_deref(), Some("seven"));
    assert_eq!((read.is_binary_wanted, read.timeout_us), (true, Some(900)));
    let output = json!({"name": "sed_j_per_m3", "parameters": {"binary_data": false}});
    request["outputs"] = json!([output]);
    assert!(!read_json(&request).unwrap().is_binary_wanted);
}

#[test]
fn what_the_model_does_not_take_is_refused_by_field() {
    let data = vec![0; MAP_LEN];
    for (members, code, field) in [
        (json!({"data": [1]}), ErrorCode::WrongLength, "data"),
        (json!({"data": vec![0; MAP_LEN + 1]}), ErrorCode::WrongLength, "data"),
        (json!({"data": data, "name": "x"}), ErrorCode::BadQuery, "inputs"),
        (json!({"data": data, "datatype": "FP16"}), ErrorCode::WrongType, "datatype"),
        (json!({"data": data, "shape": [224, 224]}), ErrorCode::WrongShape, "shape"),
        (json!({}), ErrorCode::WrongType, "inputs"),
        (
            json!({"parameters": {"binary_data_size": 200_704}}),
            ErrorCode::WrongLength,
            "binary_data_size",
        ),
        (
            json!({"parameters": {"shared_memory_region": "r"}}),
            ErrorCode::WrongType,
            "shared_memory_region",
        ),
    ] {
        let error = read_json(&input(&members)).unwrap_err();
        assert_eq!(error, (code, Some(field.to_owned())));
    }
    let with = |name: &str, value: Value| {
        let mut request = input(&json!({"data": data}));
        request[name] = value;
        read_json(&request).unwrap_err()
    };
    let output = |members: Value| with("outputs", json!([members]));
    assert_eq!(output(json!({"name": "x"})).0, ErrorCode::BadQuery);
    let classes = json!({"name": "sed_j_per_m3", "parameters": {"classification": 3}});
    assert_eq!(output(classes).0, ErrorCode::WrongType);
    assert_eq!(with("inputs", json!([])).0, ErrorCode::WrongShape);
    assert_eq!(with("parameters", json!({"timeout": -1})).1.as_deref(), Some("timeout"));
    let elsewhere = with("parameters", json!({"finger": "thumb"}));
    assert_eq!(elsewhere, (ErrorCode::BadQuery, Some("finger".to_owned())));
    for bad in ["", "{", "[]", "{\"inputs\": 1}", "{\"inputs\": [{\"data\": [\"a\"]}]}"] {
        let error = Request::read(&Bytes::from(bad), None).unwrap_err();
        assert_eq!(error.code, ErrorCode::BadJson, "{bad}");
    }
}

#[test]
fn bytes_behind_the_json_are_the_map() {
    let head = input(&json!({"parameters": {"binary_data_size": MAP_LEN * 4}})).to_string();
    let mut body = head.clone().into_bytes();
    body.resize(head.len() + MAP_LEN * 4, 7);
    assert_eq!(head_len(None, body.len()).unwrap(), None);
    let length = head_len(Some(head.len().to_string().as_bytes()), body.len()).unwrap();
    assert_eq!(length, Some(head.len()));
    let map = Request::read(&Bytes::from(body.clone()), length).unwrap().pressure_pa;
    assert!(map.len() == MAP_LEN * 4 && map.iter().all(|&byte| byte == 7));
    body.pop();
    let error = Request::read(&Bytes::from(body), length).unwrap_err();
    assert_eq!(error.code, ErrorCode::WrongLength);
    for bad in [&b"-1"[..], b"x", b"99", b"\xff"] {
        let error = head_len(Some(bad), 98).unwrap_err();
        assert_eq!(error.code, ErrorCode::WrongLength, "{bad:?}");
    }
    let error = Request::read(&Bytes::from_static(b"{}"), Some(3)).unwrap_err();
    assert_eq!(error.code, ErrorCode::WrongLength);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_body_panics(text in "[\\[\\]{}\",:a-z0-9 .-]{0,200}", length in 0_usize..300) {
        let body = Bytes::from(text);
        let length = (length < 200).then_some(length);
        prop_assert!(Request::read(&body, length).is_err());
    }

    #[test]
    fn maps_come_through_as_they_were(seed in any::<u64>(), depth in 0_usize..3) {
        let mut random = fastrand::Rng::with_seed(seed);
        let map: Vec<f32> = (0..MAP_LEN).map(|_| random.f32() * 1e5).collect();
        let bytes: Vec<u8> = map.iter().flat_map(|v| v.to_le_bytes()).collect();
        let rows: Vec<_> = map.chunks(224).map(<[f32]>::to_vec).collect();
        let data = match depth {
            0 => json!(map),
            1 => json!(rows),
            _ => json!([[rows]]),
        };
        let found = read_json(&input(&json!({"data": data}))).unwrap();
        prop_assert!(found.pressure_pa == bytes, "in digits");
        let head = input(&json!({"parameters": {"binary_data_size": MAP_LEN * 4}})).to_string();
        let body = Bytes::from([head.as_bytes(), &bytes].concat());
        let found = Request::read(&body, Some(head.len())).unwrap();
        prop_assert!(found.pressure_pa == bytes, "as bytes");
        let short = random.usize(..body.len());
        prop_assert!(Request::read(&body.slice(..short), Some(head.len().min(short))).is_err());
    }
}
