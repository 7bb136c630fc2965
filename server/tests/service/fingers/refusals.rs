//! What cannot be served is refused by the finger's name, and harms nobody else.

use std::fs;

use papilla_contact::finger_file_sha256;
use serde_json::{Value, json};

use super::support::{add, folder, index, named, service, service_with, thumb_atlas};
use crate::support::{
    GAIN, Service, add_model_of_gain,
    contact::{atlas, atlas_of, ball_hello, deep, model, model_described, model_of_finger, rows},
    hello, papilla, write,
};

/// What a hello with these fingers is refused with; the session lives on.
async fn refusal(service: &Service, hello: Value, code: &str) -> Value {
    let mut socket = service.socket().await;
    socket.send(hello.to_string()).await;
    let error = socket.hear_refusal(code).await;
    let ready = socket.open(ball_hello(&json!({}))).await;
    assert_eq!(ready["tier"], "quick");
    error
}

fn assert_says(error: &Value, field: &str, words: &[&str]) {
    let message = error["message"].as_str().unwrap();
    assert_eq!(error["field"], field, "{message}");
    for word in words {
        assert!(message.contains(word), "'{word}' is not in: {message}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_name_that_nobody_has_is_refused_with_those_there_are() {
    let fingers = folder();
    // Not a finger, though it lies there; and what lies beside the folder.
    fs::write(fingers.path().join("file"), "").unwrap();
    let service = service(&fingers).await;
    for name in ["nobody", "file", "..", "../thumb", "thumb/", "Thumb", ""] {
        let error = refusal(&service, hello(&named(&["default", name])), "bad_contact").await;
        assert_says(&error, "fingers[1].name", &["no finger", "default, thumb"]);
    }
    let plain = Service::start().await;
    let mut socket = plain.socket().await;
    socket.send(hello(&named(&["thumb"])).to_string()).await;
    let error = socket.hear_refusal("bad_contact").await;
    assert_says(&error, "fingers[0].name", &["'thumb'", "--fingers DIR"]);
    // Its own it may be called by its name.
    socket.open(hello(&named(&["default"]))).await;
    assert_eq!(plain.json("/v1/fingers").await["fingers"].as_array().unwrap().len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn poses_need_a_contact_model_of_that_finger() {
    let fingers = folder();
    fs::remove_file(fingers.path().join("thumb/finger.contact")).unwrap();
    let service = service(&fingers).await;
    let error = refusal(&service, ball_hello(&named(&["default", "thumb"])), "bad_contact").await;
    assert_says(&error, "input", &["finger 'thumb'", "finger.contact"]);
    // Pressure it takes.
    let mut socket = service.socket().await;
    socket.open(hello(&named(&["default", "thumb"]))).await;
}

/// Each fault of a folder, as it is told to whoever names the finger.
#[tokio::test(flavor = "multi_thread")]
async fn a_folder_that_is_half_written_or_mixed_is_refused_with_what_is_wrong() {
    let fingers = folder();
    let broken = |name: &str| {
        add(fingers.path(), name, &thumb_atlas(), GAIN);
        fingers.path().join(name)
    };
    for (name, file) in [
        ("toml", "finger.toml"),
        ("index", "index.json"),
        ("atlas", "atlas.json"),
        ("net", "own.onnx"),
    ] {
        fs::remove_file(broken(&format!("no-{name}")).join(file)).unwrap();
    }
    let torn = broken("torn").join("own.onnx");
    let bytes = fs::read(&torn).unwrap();
    fs::write(&torn, &bytes[..bytes.len() / 2]).unwrap();
    write(&broken("other-contact"), "finger.contact", &model());
    // Made of a finger whose tissues, or whose skin, were others.
    let described = |text: &str| finger_file_sha256(text, |_| Some(b"{}".to_vec())).unwrap();
    let text = "[shape]\nskin = \"skin.json\"\n[tissue.dermis]\nyoungs_modulus_mpa = 0.1\n";
    let (other_text, made) = (text.replace("0.1", "0.2"), described(text));
    for (name, skin, text) in
        [("as-made", "{}", text), ("other-skin", "[]", text), ("other-tissue", "{}", &other_text)]
    {
        let folder = broken(name);
        write(&folder, "finger.toml", text.as_bytes());
        write(&folder, "skin.json", skin.as_bytes());
        write(&folder, "finger.contact", &model_described(&thumb_atlas(), &made));
    }
    // Networks of a finger with the same atlas, whose tissues were others.
    for (name, trained) in [("own-network", "a"), ("network-of-before", "b")] {
        let folder = broken(name);
        for tier in ["own", "quick"] {
            let path = folder.join(format!("{tier}.json"));
            let mut card: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
            card["training"]["finger_sha256"] = json!(trained.repeat(64));
            fs::write(&path, card.to_string()).unwrap();
        }
        write(&folder, "finger.contact", &model_of_finger(&thumb_atlas(), &"a".repeat(64)));
    }
    write(
        &broken("network-of-nobody"),
        "finger.contact",
        &model_of_finger(&thumb_atlas(), &"a".repeat(64)),
    );
    // A finger whose tissues alone are others than the default one's has the same atlas. With that
    // finger's networks it says so.
    add(fingers.path(), "softer", &atlas(), GAIN);
    let softer = fingers.path().join("softer");
    write(&softer, "finger.contact", &model_of_finger(&atlas(), &"a".repeat(64)));
    let both = json!({"default": "own", "models": ["own", "quick"], "trained_on": "default"});
    index(&softer, &both);
    let damaged = broken("damaged-contact").join("finger.contact");
    let bytes = fs::read(&damaged).unwrap();
    fs::write(&damaged, &bytes[..bytes.len() / 2]).unwrap();
    add_model_of_gain(&broken("other-network"), "own", atlas().hash(), 0, 0.1, GAIN);
    // Lent, but by nobody who can lend, or of pixels that show other places.
    let models = |lender: &str| json!({"default": "own", "models": ["own"], "trained_on": lender});
    index(&broken("no-lender"), &models("thumb"));
    add_model_of_gain(&fingers.path().join("no-lender"), "own", atlas().hash(), 0, 0.1, GAIN);
    index(&broken("third-atlas"), &models("default"));
    add_model_of_gain(
        &fingers.path().join("third-atlas"),
        "own",
        atlas_of(0.3).hash(),
        0,
        0.1,
        GAIN,
    );
    let other_pixels = broken("other-pixels");
    write(&other_pixels, "atlas.json", crate::support::atlas().to_json().unwrap().as_bytes());
    add_model_of_gain(&other_pixels, "own", atlas().hash(), 0, 0.1, GAIN);
    index(&other_pixels, &models("default"));
    let service = service(&fingers).await;
    for (name, words) in [
        ("no-toml", &["finger.toml", "copy it anew"][..]),
        ("no-index", &["index.json"]),
        ("no-atlas", &["atlas.json"]),
        ("no-net", &["own.onnx"]),
        ("torn", &["own.onnx"]),
        ("other-contact", &["finger.contact", "atlas"]),
        ("network-of-before", &["own.json", "another finger"]),
        ("network-of-nobody", &["own.json", "another finger"]),
        ("other-skin", &["finger.contact", "finger build"]),
        ("other-tissue", &["finger.contact", "finger build"]),
        ("damaged-contact", &["finger.contact"]),
        ("other-network", &["own.onnx", atlas().hash(), "\"trained_on\": \"default\""]),
        ("no-lender", &["own.onnx", "'thumb'"]),
        ("third-atlas", &["own.onnx", atlas_of(0.3).hash()]),
        ("other-pixels", &["own.onnx", "other places of the skin"]),
    ] {
        let error = refusal(&service, hello(&named(&["thumb", name])), "bad_model").await;
        let said = format!("finger '{name}'");
        assert_says(&error, "fingers[1].name", &[&[said.as_str()], words].concat());
    }
    let ready =
        service.socket().await.open(hello(&named(&["as-made", "own-network", "softer"]))).await;
    let lenders: Vec<&Value> = ready["finger_terms"]
        .as_array()
        .unwrap()
        .iter()
        .map(|terms| &terms["trained_on"])
        .collect();
    assert_eq!(lenders, [&Value::Null, &Value::Null, &json!("default")]);
    // Whoever mends it is not told the old fault once the models were reloaded.
    fs::copy(fingers.path().join("thumb/finger.toml"), fingers.path().join("no-toml/finger.toml"))
        .unwrap();
    let error = refusal(&service, hello(&named(&["no-toml"])), "bad_model").await;
    assert_says(&error, "fingers[0].name", &["finger.toml"]);
    let answer = service.post("/v1/admin/reload", "").send().await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    service.socket().await.open(hello(&named(&["no-toml"]))).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn no_more_fingers_are_loaded_than_may_be() {
    let fingers = folder();
    add(fingers.path(), "little", &thumb_atlas(), GAIN);
    let service = service_with(&fingers, |config| {
        config.max_loaded_fingers = std::num::NonZeroUsize::MIN;
    })
    .await;
    service.socket().await.open(ball_hello(&named(&["default", "thumb"]))).await;
    for _ in 0..2 {
        let error = refusal(&service, hello(&named(&["little"])), "overloaded").await;
        assert_says(&error, "fingers[0].name", &["'little'", "thumb", "--max-loaded-fingers"]);
    }
    service.socket().await.open(hello(&named(&["thumb", "thumb"]))).await;
    let list = service.json("/v1/fingers").await;
    let loaded: Vec<bool> = list["fingers"]
        .as_array()
        .unwrap()
        .iter()
        .map(|finger| finger["loaded"].as_bool().unwrap())
        .collect();
    assert_eq!((loaded, &list["max_loaded"]), (vec![true, true, false], &json!(1)));
    assert_eq!(service.metric("papilla_fingers_loaded").await as u64, 2);
}

/// Samples at vertices are as many on each finger of a session, or are refused.
#[tokio::test(flavor = "multi_thread")]
async fn fingers_of_other_vertices_share_maps_alone() {
    let fingers = folder();
    add(fingers.path(), "coarse", &crate::support::atlas(), GAIN);
    fs::remove_file(fingers.path().join("coarse/finger.contact")).unwrap();
    let service = service(&fingers).await;
    for layout in ["input_layout", "answer_layout"] {
        let mut hello = hello(&named(&["thumb", "coarse"]));
        hello[layout] = json!("vertices");
        let error = refusal(&service, hello.clone(), "bad_contact").await;
        assert_says(&error, "fingers[1].name", &["'coarse'", "vertices"]);
        hello["fingers"] = json!([{"name": "coarse"}]);
        service.socket().await.open(hello).await;
    }
    let ready = service.socket().await.open(hello(&named(&["thumb", "coarse"]))).await;
    assert_eq!(ready["finger_terms"][1]["vertices"], 5);
    // A client draws with one atlas; if it says which, all its fingers have to have it.
    let mut hello = ball_hello(&named(&["thumb", "default"]));
    hello["atlas_hash"] = json!(thumb_atlas().hash());
    let error = refusal(&service, hello, "atlas_mismatch").await;
    assert_says(&error, "atlas_hash", &["finger 'default'"]);
}

/// A finger that is named first by many is loaded once, and nobody else waits for it.
#[tokio::test(flavor = "multi_thread")]
async fn many_who_name_it_at_once_have_it_loaded_once() {
    let fingers = folder();
    // Measured while it is served.
    let service = service_with(&fingers, |config| config.calibration_ms = 1).await;
    let address = service.address;
    let clients = (0..8).map(|_| {
        tokio::spawn(async move {
            let mut socket = crate::support::Socket::connect(address).await.unwrap();
            socket.open(ball_hello(&named(&["thumb"]))).await;
            socket.send(rows(1, 0, &[deep(0.1)])).await;
            socket.hear_frame().await.0.tier
        })
    });
    for client in clients.collect::<Vec<_>>() {
        // The first place of the second finger.
        assert_eq!(client.await.unwrap(), 64);
    }
    assert_eq!(service.json("/v1/fingers").await["fingers"].as_array().unwrap().len(), 2);
}

#[test]
fn check_looks_at_every_finger() {
    let fingers = folder();
    add(fingers.path(), "half", &thumb_atlas(), GAIN);
    fs::remove_file(fingers.path().join("half/finger.toml")).unwrap();
    fs::create_dir(fingers.path().join("no name")).unwrap();
    let models = crate::support::model_folder();
    let paths = [models.path(), fingers.path()].map(|path| path.to_str().unwrap().to_owned());
    let output = papilla(&["check", "--models", &paths[0], "--fingers", &paths[1]])
        .args(["--calibration-ms", "1", "--bind", "127.0.0.1:0", "--json"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let found = |what: &str| {
        let findings = report["findings"].as_array().unwrap();
        findings.iter().find(|finding| finding["what"] == what).expect(what)
    };
    assert_eq!(found("fingers")["values"], json!({"folders": 3, "loaded_max": 8}));
    let thumb = found("finger thumb");
    assert_eq!(
        (&thumb["ok"], &thumb["values"]["contact"]),
        (&json!(true), &json!(true)),
        "{thumb}"
    );
    assert_eq!(found("finger half")["ok"], false);
    assert!(found("finger half")["detail"].as_str().unwrap().contains("finger.toml"));
    assert!(found("finger no name")["detail"].as_str().unwrap().contains("rename"));
    let output = papilla(&["--fingers", "/nowhere"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("fingers"));
}
