//! What people are told: which member, which file, why, once, and in words of serde where a member has another type.

use std::fs;

use papilla_server::Config;
use serde_json::{Value, json};

use crate::support::{Service, hello, model_folder, papilla, write};

#[tokio::test(flavor = "multi_thread")]
async fn a_hello_of_a_wrong_type_names_member_and_place() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    for (members, field) in [
        (json!({"version": "3"}), "version"),
        (json!({"budget_us": -1}), "budget_us"),
        (json!({"effects": ["layers", 7]}), "effects[1]"),
        (json!({"sample_type": ["f32"]}), "sample_type"),
    ] {
        socket.send(hello(&members).to_string()).await;
        let error = socket.hear_refusal("bad_json").await;
        assert_eq!(error["field"], field, "{error}");
        let message = error["message"].as_str().unwrap();
        assert!(message.contains("line 1, column "), "{message}");
    }
    // An opening hello that was misspelt may be said again.
    socket.open(hello(&json!({}))).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_misspelt_renewal_keeps_its_reason() {
    let service = Service::start().await;
    let mut socket = service.socket().await;
    socket.open(hello(&json!({}))).await;
    socket.send(hello(&json!({"teir": "slow"})).to_string()).await;
    let error = socket.hear_refusal("bad_json").await;
    assert!(error["message"].as_str().unwrap().contains("`teir`"), "{error}");
    socket.send(hello(&json!({"budget_us": "soon"})).to_string()).await;
    assert_eq!(socket.hear_refusal("bad_json").await["field"], "budget_us");
    // What is no hello at all is still told what is due.
    for text in ["?", r#"{"type":"helo"}"#] {
        socket.send(text).await;
        let error = socket.hear_refusal("unexpected_text").await;
        assert!(error["message"].as_str().unwrap().contains("binary frames are due"), "{error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn bodies_in_json_are_refused_with_member_and_place() {
    let service = Service::start().await;
    for (path, body, word) in [
        ("/v1/sed", "5", "integer `5`"),
        ("/v1/sed", r#"{"pressure_pa": 5}"#, "pressure_pa"),
        ("/v1/sed", r#"{"pressure_pa": [1, "2"]}"#, "pressure_pa[1]"),
        ("/v2/models/quick/infer", "5", "integer `5`"),
        ("/v2/models/quick/infer", r#"{"inputs": [{"name": 5}]}"#, "inputs[0].name"),
        ("/v2/models/quick/infer", r#"{"inputs": [{"name": "x", "shape": [-1]}]}"#, "shape"),
    ] {
        let answer = service.post(path, body).header("content-type", "application/json");
        let answer = answer.send().await;
        assert_eq!(answer.status, 400, "{}", answer.text());
        let error = &answer.json()["error"];
        let message = match error {
            Value::String(text) => text.clone(),
            _ => error["message"].as_str().unwrap().to_owned(),
        };
        assert!(message.contains(word) && message.contains("line 1"), "{body}: {message}");
    }
}

/// What the program says when it does not start.
fn said(arguments: &[&str]) -> String {
    let output = papilla(arguments).args(["--bind", "127.0.0.1:0"]).output().unwrap();
    assert!(!output.status.success());
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn a_folder_is_refused_with_its_file_and_one_cause() {
    let text = said(&["--models", "/no/such/folder"]);
    assert_eq!(text.matches("No such file").count(), 1, "{text}");

    for (file, bytes, not) in [
        ("index.json", &b"{}"[..], "card"),
        ("index.json", br#"{"default": "x", "models": ["quick"]}"#, "card"),
        ("index.json", br#"{"default": 5, "models": ["quick"]}"#, "card"),
        ("ladder.json", b"{}", "card"),
        ("quick.json", b"[]", "quick.onnx"),
        ("atlas.json", br#"{"version": "1"}"#, "card"),
        ("replay.json", br#"{"presses": 5}"#, "card"),
    ] {
        let folder = model_folder();
        write(folder.path(), file, bytes);
        let text = said(&["--models", folder.path().to_str().unwrap()]);
        assert_eq!(text.matches(file).count(), 1, "{file} is to be named once: {text}");
        assert!(!text.contains(not), "{file}: {text}");
    }
}

#[test]
fn who_gave_a_folder_is_not_told_to_give_one() {
    let folder = model_folder();
    fs::remove_file(folder.path().join("quick.json")).unwrap();
    let text = said(&["--models", folder.path().to_str().unwrap()]);
    assert!(text.contains("quick.json"), "{text}");
    assert!(!text.contains("--models"), "{text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_pem_file_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let cut = "-----BEGIN CERTIFICATE-----\nMIIB\n";
    write(folder.path(), "cut.pem", cut.as_bytes());
    write(folder.path(), "start.pem", b"-----BEGIN CERTIFICATE---\nMIIB\n");
    write(
        folder.path(),
        "digits.pem",
        format!("{cut}????\n-----END CERTIFICATE-----\n").as_bytes(),
    );
    for (file, word) in [("cut.pem", "END"), ("start.pem", "BEGIN"), ("digits.pem", "base64")] {
        for (cert, key) in [(file, "key.pem"), ("good.pem", file)] {
            let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
            write(folder.path(), "good.pem", made.cert.pem().as_bytes());
            write(folder.path(), "key.pem", made.signing_key.serialize_pem().as_bytes());
            let config = Config {
                tls_cert: Some(folder.path().join(cert)),
                tls_key: Some(folder.path().join(key)),
                ..Config::default()
            };
            let error = papilla_server::start(&config).await.err().unwrap().to_string();
            assert!(error.contains(file) && error.contains(word), "{error}");
            assert!(!error.contains("45, 45"), "raw bytes: {error}");
        }
    }
}
