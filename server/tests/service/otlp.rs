//! Traces, as a collector gets them (cargo feature `otlp`).

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpListener,
    process::Command,
    sync::mpsc,
    thread,
    time::Duration,
};

use crate::support::{Request, Running, bytes_of, model_folder, ramp};

/// Takes what is posted and says thanks, as a collector does: path and body of each request.
fn collector() -> (String, mpsc::Receiver<(String, Vec<u8>)>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("http://{}", listener.local_addr().unwrap());
    let (posted, posts) = mpsc::channel();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = BufReader::new(stream.unwrap());
            let (mut first, mut length) = (String::new(), 0);
            stream.read_line(&mut first).unwrap();
            loop {
                let mut line = String::new();
                stream.read_line(&mut line).unwrap();
                let line = line.trim_end().to_ascii_lowercase();
                if line.is_empty() {
                    break;
                }
                if let Some(value) = line.strip_prefix("content-length:") {
                    length = value.trim().parse().unwrap();
                }
            }
            let mut body = vec![0; length];
            stream.read_exact(&mut body).unwrap();
            let thanks = b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\nconnection: close\r\n\r\n";
            stream.into_inner().write_all(thanks).unwrap();
            let path = first.split(' ').nth(1).unwrap_or_default().to_owned();
            if posted.send((path, body)).is_err() {
                return;
            }
        }
    });
    (endpoint, posts)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_collector_gets_the_spans_of_requests() {
    let (endpoint, posts) = collector();
    let models = model_folder();
    let mut running = Running::start_with(models.path(), &["--otlp-endpoint", &endpoint]);
    let map = Request::new(running.address, "POST", "/v1/sed").body(bytes_of(&ramp()));
    assert_eq!(map.send().await.status, 200);
    assert_eq!(Request::new(running.address, "GET", "/no/such/thing").send().await.status, 404);
    // What was not sent yet is sent at the end.
    let pid = running.child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    assert!(running.child.wait().unwrap().success());
    let mut all = Vec::new();
    while let Ok((path, body)) = posts.recv_timeout(Duration::from_secs(2)) {
        assert_eq!(path, "/v1/traces");
        all.extend(body);
    }
    // Protobuf holds texts as they are.
    let has = |word: &str| all.windows(word.len()).any(|window| window == word.as_bytes());
    for word in [
        "papilla-server",
        "POST /v1/sed",
        "http.route",
        "http.response.status_code",
        "papilla.tier",
        "quick",
        "papilla.infer_us",
        "GET other",
    ] {
        assert!(has(word), "{word} is not in {}", String::from_utf8_lossy(&all));
    }
}
