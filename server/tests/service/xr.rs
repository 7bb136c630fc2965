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
    assert_eq!((bare.status, bare.header("location")), (308, Some("xr/")));
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
        "/xr/parts/scene.js/",
        "/xr/index.html/",
        "/xr/parts/",
    ] {
        service.get(path).send().await.assert_refused(404, "not_found");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_folder_the_scene_of_the_binary_is_at_xr() {
    let service = Service::start().await;
    let bare = service.get("/xr").send().await;
    assert_eq!((bare.status, bare.header("location")), (308, Some("xr/")));
    let page = service.get("/xr/").send().await;
    assert_eq!((page.status, page.header("content-type")), (200, Some("text/html; charset=utf-8")));
    assert!(page.header("etag").is_some());
    let script = service.get("/xr/scene.js").send().await;
    assert_eq!(script.header("content-type"), Some("text/javascript; charset=utf-8"));
    let script = script.text();
    assert!(script.contains("from\"./three.js\""), "{} bytes", script.len());
    // What it shares with the page is one file, at both places.
    let [below, of_page] = [service.get("/xr/three.js"), service.get("/three.js")];
    let [below, of_page] = [below.send().await, of_page.send().await];
    assert!(below.body.len() > 100_000, "{} bytes", below.body.len());
    assert!(below.body == of_page.body);
    // Of the page's own files there are none below, and the other way round.
    for path in
        ["/xr/papilla.mjs", "/xr/nothing.js", "/xr/../index.html", "/xr//scene.js", "/scene.js"]
    {
        service.get(path).send().await.assert_refused(404, "not_found");
    }
}

/// A folder with one page in a folder of its own.
async fn with_a_page_below() -> (Service, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("sub")).unwrap();
    for page in ["index.html", "sub/index.html"] {
        fs::write(folder.path().join(page), "<!doctype html><title>page</title>").unwrap();
    }
    let path = folder.path().to_owned();
    (Service::start_with(|config| config.xr_dir = Some(path)).await, folder)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_without_its_slash_leads_to_itself_and_to_no_other_host() {
    let (service, _folder) = with_a_page_below().await;
    let bare = service.get("/xr/sub").send().await;
    assert_eq!((bare.status, bare.header("location")), (307, Some("./sub/")));
    assert_eq!(service.get("/xr/sub/").send().await.status, 200);
    let query = service.get("/xr/sub?scene=a").send().await;
    assert_eq!(query.header("location"), Some("./sub/?scene=a"));
    // `Location: //sub/` is the host `sub`.
    for path in ["/xr//sub", "/xr//sub/", "/xr///sub", "/xr/sub//"] {
        service.get(path).send().await.assert_refused(404, "not_found");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_name_that_no_file_can_have_is_not_found() {
    let (service, _folder) = with_a_page_below().await;
    for name in ["x".repeat(300), "%61".repeat(300), format!("sub/{}/x", "y".repeat(5000))] {
        service.get(&format!("/xr/{name}")).send().await.assert_refused(404, "not_found");
    }
}
