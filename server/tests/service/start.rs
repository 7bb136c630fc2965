//! A service that cannot serve does not start, and says why.

use std::{fs, path::Path};

use papilla_server::{Config, StartError};

use crate::support::{add_model, atlas, model_folder, write};

async fn start(folder: &Path, change: impl FnOnce(&mut Config)) -> Result<(), StartError> {
    let mut config = Config {
        models: Some(folder.to_owned()),
        threads: std::num::NonZeroUsize::new(1),
        calibration_ms: 0,
        ..Config::default()
    };
    change(&mut config);
    papilla_server::start(&config).await.map(drop)
}

#[tokio::test(flavor = "multi_thread")]
async fn missing_files_are_named() {
    for file in ["index.json", "atlas.json", "quick.onnx", "slow.json"] {
        let folder = model_folder();
        fs::remove_file(folder.path().join(file)).unwrap();
        let error = start(folder.path(), |_| ()).await.unwrap_err();
        assert!(matches!(&error, StartError::Missing { file: f, .. } if f == file), "{error}");
        assert_eq!(error.exit_code(), 3);
    }
    let error = start(Path::new("/no/such/folder"), |_| ()).await.unwrap_err();
    assert!(matches!(error, StartError::Folder { .. }), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_files_are_named() {
    for (file, bytes) in [
        ("index.json", &b"{}"[..]),
        ("index.json", br#"{"default": "quick", "models": []}"#),
        ("atlas.json", b"{}"),
        ("atlas.json", b"\xff"),
        ("quick.onnx", b"not onnx"),
        ("replay.json", br#"{"presses": [{"name": "x"}]}"#),
    ] {
        let folder = model_folder();
        write(folder.path(), file, bytes);
        let error = start(folder.path(), |_| ()).await.unwrap_err();
        assert!(matches!(&error, StartError::Unusable { file: f, .. } if f == file), "{error}");
        assert_eq!(error.exit_code(), 3);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tier_that_is_listed_twice_is_named() {
    let folder = model_folder();
    let index = br#"{"default": "quick", "models": ["quick", "slow", "quick"]}"#;
    write(folder.path(), "index.json", index);
    let error = start(folder.path(), |_| ()).await.unwrap_err();
    assert!(matches!(&error, StartError::Unusable { file, .. } if file == "index.json"), "{error}");
    assert!(error.to_string().contains("'quick' is listed twice"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_model_of_another_atlas_is_refused() {
    let folder = model_folder();
    let other = "f".repeat(64);
    assert_ne!(atlas().hash(), other);
    add_model(folder.path(), "slow", &other, 0, 0.1);
    let error = start(folder.path(), |_| ()).await.unwrap_err();
    assert!(error.to_string().contains(&other), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_default_tier_must_exist() {
    let folder = model_folder();
    let error = start(folder.path(), |c| c.default_tier = Some("best".into())).await.unwrap_err();
    assert!(matches!(error, StartError::UnknownDefault { .. }), "{error}");
    assert!(start(folder.path(), |c| c.default_tier = Some("slow".into())).await.is_ok());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_taken_address_is_named() {
    let folder = model_folder();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let error = start(folder.path(), |c| c.bind = address).await.unwrap_err();
    assert!(error.to_string().contains(&address.to_string()), "{error}");
    assert_eq!(error.exit_code(), 4);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_start_that_is_given_up_frees_its_port_at_once() {
    let folder = model_folder();
    let config = Config { models: Some(folder.path().to_owned()), ..Config::default() };
    let starting = papilla_server::listen(&config).unwrap();
    let address = starting.address();
    assert!(std::net::TcpListener::bind(address).is_err(), "it listens");
    drop(starting);
    let free = async {
        while std::net::TcpListener::bind(address).is_err() {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
        }
    };
    tokio::time::timeout(std::time::Duration::from_secs(30), free).await.expect("still taken");
}
