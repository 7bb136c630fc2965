//! What may lie in a folder of models beside good files.

use std::{
    fs::{self, File},
    os::unix::fs::symlink,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use papilla_server::StartError;

use super::{add_model, atlas, list, write};
use crate::support::{Answer, Logged, Request, Service, model_folder, papilla};

/// No step below takes longer, not even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(40);

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

async fn reload(logged: &Logged) -> Answer {
    let request = Request::new(logged.running.address, "POST", "/v1/admin/reload").body("");
    tokio::time::timeout(PATIENCE, request.send()).await.expect("the reload hangs")
}

/// Ends the process as an operator does; its exit code.
fn terminate(mut logged: Logged) -> Option<i32> {
    let child = &mut logged.running.child;
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("the process does not end");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_that_never_ends_is_refused_and_blocks_nothing() {
    let folder = model_folder();
    let logged = Logged::start(folder.path(), &["--log", "warn"]);
    let file = folder.path().join("quick.onnx");
    let good = fs::read(&file).unwrap();
    fs::remove_file(&file).unwrap();
    pipe(&file);
    let answer = reload(&logged).await;
    assert!(answer.text().contains("quick.onnx") && answer.text().contains("pipe"), "{answer:?}");
    answer.assert_refused(422, "bad_model");
    fs::remove_file(&file).unwrap();
    symlink("/dev/zero", &file).unwrap();
    let answer = reload(&logged).await;
    assert!(answer.text().contains("quick.onnx") && answer.text().contains("device"), "{answer:?}");
    fs::remove_file(&file).unwrap();
    fs::write(&file, &good).unwrap();
    assert_eq!(reload(&logged).await.status, 200);
    fs::remove_file(&file).unwrap();
    pipe(&file);
    reload(&logged).await.assert_refused(422, "bad_model");
    assert_eq!(terminate(logged), Some(0));
}

#[test]
fn a_start_on_a_file_that_never_ends_says_so() {
    let folder = model_folder();
    fs::remove_file(folder.path().join("atlas.json")).unwrap();
    pipe(&folder.path().join("atlas.json"));
    let mut child = papilla(&["--models", folder.path().to_str().unwrap()])
        .args(["--bind", "127.0.0.1:0"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = child.kill();
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.contains("atlas.json") && text.contains("pipe"), "{text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn strangers_are_named_and_passed_over() {
    let folder = model_folder();
    let logged = Logged::start(folder.path(), &["--log", "warn"]);
    // What Emacs leaves beside a file that is being edited: a link to nothing.
    symlink("me@desk.1234:56", folder.path().join(".#index.json")).unwrap();
    fs::create_dir(folder.path().join("old.onnx")).unwrap();
    pipe(&folder.path().join("notes.json"));
    symlink("loop.json", folder.path().join("loop.json")).unwrap();
    fs::write(folder.path().join("spare.onnx"), b"not asked for").unwrap();
    let answer = reload(&logged).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let log = logged.log();
    for name in [".#index.json", "old.onnx", "notes.json", "loop.json"] {
        let line = log.lines().find(|line| line.contains(name)).unwrap_or_default();
        assert!(line.contains("passed over"), "{name} is not named in\n{log}");
    }
    // Nobody asked for it, and it could be read.
    assert!(!log.contains("spare.onnx"), "{log}");
    assert_eq!(terminate(logged), Some(0));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_beyond_the_greatest_size_is_not_read() {
    let service = Service::start().await;
    let folder = service.models.path();
    add_model(folder, "third", atlas().hash(), 0, 0.1);
    list(folder, "quick", &["quick", "slow", "third"]);
    // No blocks behind it: what would be read is zeros.
    File::create(folder.join("third.onnx")).unwrap().set_len(1 << 40).unwrap();
    let answer = service.post("/v1/admin/reload", "").send().await;
    assert!(answer.text().contains("third.onnx") && answer.text().contains("MiB"), "{answer:?}");
    answer.assert_refused(422, "bad_model");
    let error = Service::on(model_folder(), |config| {
        config.models = Some(folder.to_owned());
    });
    let error = error.await.err().unwrap();
    assert!(matches!(&error, StartError::Unusable { file, .. } if file == "third.onnx"), "{error}");
    write(folder, "third.onnx", b"");
}
