//! Which pages may use the service.
//!
//! A browser sends any page's WebSocket handshakes and simple posts to any address it can reach,
//! this machine's loopback included; only the `Origin` it adds tells whose page it is.

use std::net::IpAddr;

use axum::http::{
    HeaderMap, HeaderName, HeaderValue, Method, Version, header, request::Parts, uri::Authority,
};
use papilla_proto::{ErrorCode, Problem, error::shortened};
use tower_http::cors::{AllowPrivateNetwork, CorsLayer};

/// Headers of an answer that a page may read.
const EXPOSED: [&str; 11] = [
    "x-papilla-tier",
    "x-papilla-queue-us",
    "x-papilla-infer-us",
    "x-papilla-total-us",
    "x-papilla-flags",
    "x-papilla-sed-error-median",
    "x-papilla-sed-error-p90",
    "x-sed-max-j-per-m3",
    "x-pressure-max-pa",
    "inference-header-content-length",
    "retry-after",
];

/// Refuses a request that does not name one host, and on the loopback one that names a stranger's:
/// a page whose name was rebound to this machine asks under that name, and as a page of the same
/// origin it says none.
///
/// # Errors
/// The host is missing, doubled, or neither an address, `localhost` nor that of an allowed origin.
pub(super) fn check_host(head: &Parts, allowed: &[String], is_local: bool) -> Result<(), Problem> {
    let bad = |message: &str| Err(Problem::new(ErrorCode::BadQuery, message).at("host"));
    let mut hosts = head.headers.get_all(header::HOST).iter();
    let host = match (hosts.next(), hosts.next()) {
        (Some(host), None) => host.to_str().unwrap_or("?"),
        (None, _) if head.version < Version::HTTP_11 => return Ok(()),
        (None, _) => return bad("the request names no host; RFC 9112 asks for one Host"),
        (Some(_), Some(_)) => return bad("the request names more than one host"),
    };
    let is_allowed = |host: &str| {
        let of_origin = allowed.iter().filter_map(|origin| origin.split_once("://"));
        is_own_name(host)
            || of_origin.into_iter().any(|(_, own)| name(own).eq_ignore_ascii_case(name(host)))
    };
    // A target in absolute form names a host as well, and goes before the header.
    let named = [Some(host), head.uri.authority().map(Authority::as_str)];
    match named.into_iter().flatten().find(|host| is_local && !is_allowed(host)) {
        None => Ok(()),
        Some(host) => {
            let host = shortened(host);
            let message = format!("this service is not known as {host}; see --allow-origin");
            Err(Problem::new(ErrorCode::Forbidden, message).at("host"))
        }
    }
}

/// Refuses the pages of strangers. Programs other than browsers send no origin.
///
/// # Errors
/// The origin is neither the service's own nor allowed.
pub(super) fn check(
    headers: &HeaderMap,
    allowed: &[String],
    is_local: bool,
) -> Result<(), Problem> {
    let mut origins = headers.get_all(header::ORIGIN).iter();
    let origin = match (origins.next(), origins.next()) {
        (None, _) => return Ok(()),
        (Some(origin), None) => origin.to_str().unwrap_or("?"),
        // No browser does; whichever were looked at, another reader might take the other.
        (Some(_), Some(_)) => {
            let message = "the request names more than one origin";
            return Err(Problem::new(ErrorCode::Forbidden, message).at("origin"));
        }
    };
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    if is_own(origin, host, is_local) || allowed.iter().any(|a| a.eq_ignore_ascii_case(origin)) {
        return Ok(());
    }
    let origin = shortened(origin);
    let message = format!("pages of {origin} may not use this service; see --allow-origin");
    Err(Problem::new(ErrorCode::Forbidden, message).at("origin"))
}

/// Whether the page came from the address it now asks.
///
/// On the loopback a name that is not its own gives away a rebound DNS entry: a stranger's page
/// whose name now resolves to this machine.
fn is_own(origin: &str, host: &str, is_local: bool) -> bool {
    let Some((_, authority)) = origin.split_once("://") else { return false };
    authority.eq_ignore_ascii_case(host) && (!is_local || is_own_name(host))
}

/// Whether no name server decides where the host is: it is an address, or `localhost`.
fn is_own_name(host: &str) -> bool {
    let name = name(host);
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    name.eq_ignore_ascii_case("localhost") || bare.parse::<IpAddr>().is_ok()
}

/// The host without its port.
fn name(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    }
}

/// Lets the pages of `origins` read answers; None without any.
pub(crate) fn cors(origins: &[String]) -> Option<CorsLayer> {
    let origins: Vec<_> = origins.iter().filter_map(|o| HeaderValue::from_str(o).ok()).collect();
    (!origins.is_empty()).then(|| {
        let own = origins.clone();
        // Browsers ask so before a public page's request to a private address or the loopback.
        let private = AllowPrivateNetwork::predicate(move |origin, _| own.contains(origin));
        CorsLayer::new()
            .allow_origin(origins)
            .allow_private_network(private)
            .allow_methods([Method::GET, Method::POST])
            .allow_headers([
                header::ACCEPT,
                header::AUTHORIZATION,
                header::CONTENT_TYPE,
                HeaderName::from_static("inference-header-content-length"),
            ])
            .expose_headers(EXPOSED.map(HeaderName::from_static))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_pages_are_told_from_strangers() {
        for (origin, host, local, own) in [
            ("http://127.0.0.1:7224", "127.0.0.1:7224", true, true),
            ("http://localhost:7224", "localhost:7224", true, true),
            ("http://[::1]:7224", "[::1]:7224", true, true),
            ("http://127.0.0.1:80", "127.0.0.1:7224", true, false),
            ("http://evil.example:7224", "127.0.0.1:7224", true, false),
            // A name that was rebound to the loopback.
            ("http://evil.example:7224", "evil.example:7224", true, false),
            ("https://lab.example", "lab.example", false, true),
            ("https://evil.example", "lab.example", false, false),
            ("null", "127.0.0.1:7224", true, false),
            ("", "", false, false),
        ] {
            assert_eq!(is_own(origin, host, local), own, "{origin} at {host}");
        }
    }
}
