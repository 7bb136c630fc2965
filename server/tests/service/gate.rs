//! Who is let in: tokens, origins, rates, places.

use std::{
    num::{NonZeroU32, NonZeroUsize},
    time::Duration,
};

use papilla_server::{Config, StartError};
use serde_json::json;
use tempfile::TempDir;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
    time::timeout,
};

use crate::support::{
    Answer, Service, Socket, bytes_of, hello, model_folder, ramp, raw_exchange, write,
};

/// Longest wait for what comes at once; only a hang takes longer.
const HANG: Duration = Duration::from_secs(60);

const LAB: &str = "lab-0123456789abcdef";
const ROOT: &str = "root-0123456789abcdef";

/// A service with two tokens; the folder holds them.
async fn guarded() -> (Service, TempDir) {
    guarded_with(|_| ()).await
}

/// The same, with changes to the configuration.
async fn guarded_with(change: impl FnOnce(&mut Config)) -> (Service, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "[[token]]\nname = \"lab\"\ntoken = \"{LAB}\"\nmax_sessions = 1\n[[token]]\nname = \
         \"root\"\ntoken = \"{ROOT}\"\nadmin = true\n"
    );
    write(folder.path(), "tokens.toml", text.as_bytes());
    let path = folder.path().join("tokens.toml");
    let service = Service::start_with(|config| {
        config.tokens = Some(path);
        change(config);
    });
    (service.await, folder)
}

fn bearer(token: &str) -> String {
    format!("Bearer {token}")
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_token_only_the_page_and_the_health_checks_answer() {
    let (service, _tokens) = guarded().await;
    for path in ["/", "/api.html", "/healthz", "/readyz", "/openapi.json", "/v2/health/ready"] {
        assert_eq!(service.get(path).send().await.status, 200, "{path}");
    }
    for path in ["/v1/tiers", "/metrics", "/v1/atlas", "/v1/session", "/no/such/thing"] {
        let answer = service.get(path).send().await;
        assert_eq!(answer.header("www-authenticate"), Some("Bearer"), "{path}");
        answer.assert_refused(401, "unauthorized");
    }
    let v2 = service.get("/v2").send().await;
    assert_eq!((v2.status, v2.header("x-papilla-code")), (401, Some("unauthorized")));
    for wrong in ["Bearer lab", "Bearer ", "Bearer", "Basic bGFiOng=", LAB] {
        let answer = service.get("/v1/tiers").header("authorization", wrong).send().await;
        answer.assert_refused(401, "unauthorized");
    }
    for right in [bearer(LAB), format!("bearer {ROOT}")] {
        let answer = service.get("/v1/tiers").header("authorization", &right).send().await;
        assert_eq!(answer.status, 200);
    }
    let map = service.post("/v1/sed", bytes_of(&ramp())).header("authorization", &bearer(LAB));
    assert_eq!(map.send().await.status, 200);
    service.post("/v1/sed", bytes_of(&ramp())).send().await.assert_refused(401, "unauthorized");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_token_has_its_number_of_sessions() {
    let (service, _tokens) = guarded().await;
    let lab = bearer(LAB);
    let lab = [("authorization", lab.as_str())];
    let mut first = Socket::connect_with(service.address, "", &lab).await.unwrap();
    first.open(hello(&json!({}))).await;
    let (status, error) = Socket::connect_with(service.address, "", &lab).await.err().unwrap();
    assert_eq!((status, &error["error"]["code"]), (503, &json!("overloaded")), "{error}");
    // Another token has its own; a browser may put it into the query.
    let query = format!("?access_token={ROOT}");
    let mut other = Socket::connect_with(service.address, &query, &[]).await.unwrap();
    other.open(hello(&json!({}))).await;
    assert_eq!(Socket::connect(service.address).await.err().unwrap().0, 401);
    let root = bearer(ROOT);
    let text = service.get("/metrics").header("authorization", &root).send().await.text();
    assert!(text.contains("papilla_shed_total{reason=\"token_sessions\"} 1\n"), "{text}");
    // A place that is given back can be taken again.
    first.close(None).await;
    drop(first);
    let mut again = Socket::connect_with(service.address, "", &lab).await;
    while again.is_err() {
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
        again = Socket::connect_with(service.address, "", &lab).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_browser_gets_its_token_as_a_cookie() {
    let (service, _tokens) = guarded().await;
    let answer = service.get(&format!("/?access_token={LAB}")).send().await;
    assert_eq!((answer.status, answer.header("location")), (303, Some("?")));
    let cookie = answer.header("set-cookie").unwrap();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    let pair = cookie.split(';').next().unwrap();
    let with = |path: &str| service.get(path).header("cookie", pair).send();
    assert_eq!(with("/v1/tiers").await.status, 200);
    assert_eq!(with("/").await.status, 200);
    service.get("/?access_token=wrong").send().await.assert_refused(401, "unauthorized");
    // Elsewhere a token does not belong into the query, where logs keep it.
    let leak = service.get(&format!("/v1/tiers?access_token={LAB}")).send().await;
    leak.assert_refused(401, "unauthorized");
    assert!(leak.text().contains("/v1/session alone"), "{}", leak.text());
    assert!(leak.text().contains("Authorization: Bearer"), "{}", leak.text());
    // A proxy may serve all this below a path: the cookie is of the folder that was asked for.
    assert!(!cookie.contains("Path"), "{cookie}");
    let wrong =
        service.get("/v1/tiers").header("authorization", "Bearer none-of-these").send().await;
    assert!(wrong.text().contains("line ends"), "{}", wrong.text());
}

/// As an editor or a shell leaves it.
#[tokio::test(flavor = "multi_thread")]
async fn a_token_of_a_file_ends_where_its_letters_end() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let text = format!("\u{feff}[[token]]\nname = \"lab\"\ntoken = \"\"\"\n{LAB}\n\"\"\"\n");
    std::fs::write(file.path(), text).unwrap();
    let path = file.path().to_owned();
    let service = Service::start_with(|config| config.tokens = Some(path)).await;
    let tiers = service.get("/v1/tiers").header("authorization", &bearer(LAB)).send().await;
    assert_eq!(tiers.status, 200, "{}", tiers.text());
}

#[tokio::test(flavor = "multi_thread")]
async fn only_an_administrator_reloads() {
    let (service, _tokens) = guarded().await;
    let reload = |token: &str| {
        service.post("/v1/admin/reload", "").header("authorization", &bearer(token)).send()
    };
    reload(LAB).await.assert_refused(403, "forbidden");
    assert_eq!(reload(ROOT).await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_of_strangers_are_refused() {
    let service = Service::start_with(|config| {
        config.allow_origin = vec!["https://lab.example".to_owned()];
    })
    .await;
    let own = format!("http://{}", service.address);
    let stranger = "https://evil.example";
    for (origin, status) in [(own.as_str(), 200), ("https://lab.example", 200), (stranger, 403)] {
        // The host a browser would send.
        let bytes = format!(
            "POST /v1/sed HTTP/1.1\r\nhost: {}\r\norigin: {origin}\r\nconnection: \
             close\r\ncontent-length: {}\r\n\r\n",
            service.address,
            4 * ramp().len()
        );
        let bytes = [bytes.into_bytes(), bytes_of(&ramp())].concat();
        let answer = crate::support::raw_exchange(service.address, &bytes).await;
        let answer = crate::support::Answer::parse(&answer);
        assert_eq!(answer.status, status, "{origin}");
        let allowed = answer.header("access-control-allow-origin");
        assert_eq!(allowed, (origin == "https://lab.example").then_some(origin), "{origin}");
        let socket = Socket::connect_with(service.address, "", &[("origin", origin)]).await;
        assert_eq!(socket.err().map(|(status, _)| status), (status == 403).then_some(403));
    }
    let preflight = crate::support::Request::new(service.address, "OPTIONS", "/v1/sed")
        .header("origin", "https://lab.example")
        .header("access-control-request-method", "POST")
        .header("access-control-request-headers", "authorization")
        .send()
        .await;
    assert_eq!(preflight.header("access-control-allow-origin"), Some("https://lab.example"));
    // A public page asks so before it reaches into a private network.
    for (origin, due) in [("https://lab.example", Some("true")), (stranger, None)] {
        let preflight = crate::support::Request::new(service.address, "OPTIONS", "/v1/sed")
            .header("origin", origin)
            .header("access-control-request-method", "POST")
            .header("access-control-request-private-network", "true")
            .send()
            .await;
        assert_eq!(preflight.header("access-control-allow-private-network"), due, "{origin}");
    }
}

/// Sends a request of these lines, and an empty line behind them.
async fn asked(service: &Service, lines: &[&str]) -> Answer {
    let bytes = format!("{}\r\nconnection: close\r\n\r\n", lines.join("\r\n"));
    Answer::parse(&raw_exchange(service.address, bytes.as_bytes()).await)
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_of_strangers_may_not_read_either() {
    let service = Service::start_with(|config| {
        config.allow_origin = vec!["https://lab.example".to_owned()];
    })
    .await;
    let port = service.address.port();
    for path in ["/v1/tiers", "/metrics", "/healthz", "/", "/v2/models/quick", "/nothing"] {
        let line = format!("GET {path} HTTP/1.1");
        let host = format!("host: 127.0.0.1:{port}");
        let stranger = asked(&service, &[&line, &host, "origin: https://evil.example"]).await;
        assert_eq!(stranger.status, 403, "{path}");
        // A name that was rebound to the loopback: its page is of the same origin, and says none.
        let rebound = asked(&service, &[&line, &format!("host: evil.example:{port}")]).await;
        assert_eq!(rebound.status, 403, "{path}");
    }
    let tiers = "GET /v1/tiers HTTP/1.1";
    for host in ["localhost", "127.0.0.1:1", "[::1]:7224", "LOCALHOST:7224", "lab.example"] {
        let own = asked(&service, &[tiers, &format!("host: {host}")]).await;
        assert_eq!(own.status, 200, "{host}");
    }
    let lab = asked(&service, &[tiers, "host: localhost", "origin: https://lab.example"]).await;
    assert_eq!(lab.status, 200);
    let ours = "origin: https://lab.example";
    for other in ["origin: https://evil.example", ours] {
        let both = asked(&service, &[tiers, "host: localhost", ours, other]).await;
        assert_eq!(both.assert_refused(403, "forbidden").as_deref(), Some("origin"), "{other}");
    }
}

/// RFC 9112 3.2.
#[tokio::test(flavor = "multi_thread")]
async fn a_request_names_one_host() {
    let service = Service::start().await;
    for hosts in [
        &[][..],
        &["host: localhost", "host: localhost"],
        &["host: localhost", "host: evil.example"],
    ] {
        let lines = [&["GET /v1/tiers HTTP/1.1"][..], hosts].concat();
        let answer = asked(&service, &lines).await;
        assert_eq!(answer.assert_refused(400, "bad_query").as_deref(), Some("host"), "{hosts:?}");
    }
    let old = asked(&service, &["GET /v1/tiers HTTP/1.0"]).await;
    assert_eq!(old.status, 200, "version 1.0 knows no Host");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_asks_too_often_is_told_so() {
    let service = Service::start_with(|config| {
        config.rate_per_s = 1;
        config.rate_burst = NonZeroU32::new(3);
    })
    .await;
    let mut refused = 0;
    for _ in 0..100 {
        let answer = service.get("/healthz").send().await;
        if answer.status == 429 {
            refused += 1;
            assert_eq!(answer.header("retry-after"), Some("1"));
            answer.assert_refused(429, "rate_limited");
        }
    }
    assert!((1..=97).contains(&refused), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_has_its_greatest_size() {
    let service = Service::start_with(|config| config.max_body_bytes = 4 * 224 * 224).await;
    let map = bytes_of(&ramp());
    assert_eq!(service.post("/v1/sed", map.clone()).send().await.status, 200);
    let longer = [map, vec![0]].concat();
    service.post("/v1/sed", longer).send().await.assert_refused(413, "too_large");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_strangers_reach_asks_for_tokens_or_is_told_not_to() {
    let everywhere = std::net::SocketAddr::from(([0, 0, 0, 0], 0));
    let result = Service::on(model_folder(), |config| config.bind = everywhere).await;
    let error = result.err().unwrap();
    assert!(matches!(&error, StartError::Setting(s) if s.field == "bind"), "{error}");
    assert_eq!(error.exit_code(), 2);
    let open = Service::on(model_folder(), |config| {
        config.bind = everywhere;
        config.allow_anyone = true;
        config.threads = NonZeroUsize::new(1);
    });
    assert!(open.await.is_ok());
    let missing = Service::on(model_folder(), |c| c.tokens = Some("/no/such/tokens".into())).await;
    assert!(missing.err().unwrap().to_string().contains("/no/such/tokens"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_holder_of_a_token_gets_in_beside_any_number_of_slow_strangers() {
    let (service, _tokens) = guarded_with(|config| {
        config.max_connections = NonZeroUsize::new(64).unwrap();
        // Nobody is dropped for being slow while this lasts.
        config.io_timeout_s = 600;
    })
    .await;
    let mut strangers = Vec::new();
    for _ in 0..600 {
        let mut stranger = TcpStream::connect(service.address).await.unwrap();
        let _ = stranger.write_all(b"GET /healthz HTTP/1.1\r\nhost").await;
        strangers.push(stranger);
    }
    let mut holder = TcpStream::connect(service.address).await.unwrap();
    holder.write_all(&tiers_asked_by_lab(&service)).await.unwrap();
    let mut start = [0; 12];
    timeout(HANG, holder.read_exact(&mut start)).await.expect("no answer").unwrap();
    assert_eq!(&start, b"HTTP/1.1 200");
}

/// A request that shows a token.
fn tiers_asked_by_lab(service: &Service) -> Vec<u8> {
    let address = service.address;
    let head = format!("GET /v1/tiers HTTP/1.1\r\nhost: {address}\r\n");
    format!("{head}authorization: Bearer {LAB}\r\n\r\n").into_bytes()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_has_shown_a_token_does_not_count_as_a_strangers() {
    let (service, _tokens) = guarded_with(|config| {
        config.max_connections = NonZeroUsize::new(32).unwrap();
    })
    .await;
    // Two at a time are what one address may have without a token.
    let mut holders = Vec::new();
    for n in 0..20 {
        let mut holder = TcpStream::connect(service.address).await.unwrap();
        holder.write_all(&tiers_asked_by_lab(&service)).await.unwrap();
        let mut start = [0; 12];
        timeout(HANG, holder.read_exact(&mut start)).await.expect("no answer").unwrap();
        assert_eq!(&start, b"HTTP/1.1 200", "connection {n}");
        holders.push(holder);
    }
}
