//! Models that the engine's backend panics over: refused in one line of the log.

use crate::support::{
    Logged, Request, Service, add_model_to_panic_over, atlas, model_folder, papilla,
};

#[test]
fn a_start_names_the_file_in_one_line() {
    let folder = model_folder();
    add_model_to_panic_over(folder.path(), "quick", atlas().hash());
    let folder = folder.path().to_str().unwrap();
    let output =
        papilla(&["--models", folder, "--bind", "127.0.0.1:0", "--log", "warn"]).output().unwrap();
    let log = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{log}");
    assert_eq!(log.trim_end().lines().count(), 1, "{log}");
    assert!(log.contains("quick.onnx") && log.contains("out of bounds"), "{log}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reload_names_the_file_in_one_line() {
    let folder = model_folder();
    let logged = Logged::start(folder.path(), &["--log", "warn"]);
    add_model_to_panic_over(folder.path(), "quick", atlas().hash());
    let address = logged.running.address;
    let answer = Request::new(address, "POST", "/v1/admin/reload").body("").send().await;
    assert!(answer.text().contains("quick.onnx"), "{}", answer.text());
    answer.assert_refused(422, "bad_model");
    let log = logged.log();
    assert_eq!(log.trim_end().lines().count(), 1, "{log}");
    assert!(log.contains("quick.onnx") && log.contains("out of bounds"), "{log}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_model_that_is_fixed_is_taken() {
    let service = Service::start().await;
    let reload = || service.post("/v1/admin/reload", "").send();
    let file = service.models.path().join("quick.onnx");
    let (good, card) =
        (std::fs::read(&file).unwrap(), std::fs::read(file.with_extension("json")).unwrap());
    add_model_to_panic_over(service.models.path(), "quick", atlas().hash());
    assert_eq!(reload().await.status, 422);
    crate::support::write(service.models.path(), "quick.onnx", &good);
    crate::support::write(service.models.path(), "quick.json", &card);
    assert_eq!(reload().await.status, 200);
}
