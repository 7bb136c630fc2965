//! The page comes from the binary, whole and with the right types.

use crate::support::Service;

#[tokio::test(flavor = "multi_thread")]
async fn the_page_and_all_it_names_are_served() {
    let service = Service::start().await;
    let page = service.get("/").send().await;
    assert_eq!(page.status, 200);
    assert_eq!(page.header("content-type"), Some("text/html; charset=utf-8"));
    let html = page.text();
    // What the page names by src= and href=, and what the modules import.
    let mut names: Vec<String> = ["src=\"", "href=\""]
        .iter()
        .flat_map(|key| html.split(key).skip(1))
        .filter_map(|rest| Some(rest.split_once('"')?.0.trim_start_matches("./").to_owned()))
        .filter(|name| !name.contains(':') && !name.starts_with('#') && !name.contains('/'))
        .collect();
    assert!(names.iter().any(|name| name.ends_with(".mjs")), "{names:?}");
    let mut done = 0;
    while done < names.len() {
        let name = names[done].clone();
        done += 1;
        let file = service.get(&format!("/{name}")).send().await;
        assert_eq!(file.status, 200, "{name}");
        let due = match name.rsplit_once('.').map(|(_, ending)| ending) {
            Some("mjs") => "text/javascript; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("svg") => "image/svg+xml",
            _ => continue,
        };
        assert_eq!(file.header("content-type"), Some(due), "{name}");
        assert_eq!(file.header("cache-control"), Some("no-cache"));
        for import in file.text().split("from './").skip(1) {
            let import = import.split('\'').next().unwrap().to_owned();
            if !names.contains(&import) {
                names.push(import);
            }
        }
    }
    assert!(done > 5, "{names:?}");
    service.get("/nothing.mjs").send().await.assert_refused(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_the_browser_has_is_not_sent_again() {
    let service = Service::start().await;
    let first = service.get("/papilla.mjs").send().await;
    let etag = first.header("etag").unwrap().to_owned();
    let again = service.get("/papilla.mjs").header("if-none-match", &etag).send().await;
    assert_eq!((again.status, again.body.len()), (304, 0));
    let other = service.get("/papilla.mjs").header("if-none-match", "\"other\"").send().await;
    assert_eq!((other.status, other.body), (200, first.body));
}
