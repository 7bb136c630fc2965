//! A folder at `/xr`: its files and nothing else.

use std::fs;

use crate::support::Service;

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_is_served_at_xr_and_nothing_outside_of_it() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("dist");
    fs::create_dir_all(folder.join("parts")).unwrap();
    fs::write(folder.join("index.html"), "<!doctype html><title>scene</title>").unwrap();
    fs::write(folder.join("parts/scene.js"), "export const answer = 42;").unwrap();
    fs::write(root.path().join("secret.txt"), "secret").unwrap();
    let service = Service::start_with(|config| config.xr_dir = Some(folder.clone())).await;

    let bare = service.get("/xr").send().await;
    assert_eq!((bare.status, bare.header("location")), (308, Some("/xr/")));
    let page = service.get("/xr/").send().await;
    assert_eq!((page.status, page.header("content-type")), (200, Some("text/html")));
    assert!(page.text().contains("scene"));
    let script = service.get("/xr/parts/scene.js").send().await;
    assert_eq!((script.status, script.header("content-type")), (200, Some("text/javascript")));
    assert_eq!(script.header("x-content-type-options"), Some("nosniff"));
    assert_eq!(script.header("cache-control"), Some("no-cache"));

    for path in [
        "/xr/../secret.txt",
        "/xr/%2e%2e/secret.txt",
        "/xr/..%2fsecret.txt",
        "/xr/parts/..%2f..%2fsecret.txt",
        "/xr/%2fetc/passwd",
        "/xr//etc/passwd",
        "/xr/nothing.js",
    ] {
        service.get(path).send().await.assert_refused(404, "not_found");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_folder_there_is_nothing_at_xr() {
    let service = Service::start().await;
    for path in ["/xr/", "/xr/index.html"] {
        service.get(path).send().await.assert_refused(404, "not_found");
    }
}
