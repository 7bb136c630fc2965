//! Who may come in: tokens, origins and rates, asked of every request before its handler.

mod origin;
mod rate;
mod tokens;

use std::{net::IpAddr, sync::Arc, time::Instant};

use axum::{
    body::Body,
    extract::{MatchedPath, Request, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    middleware::Next,
    response::Response,
};
use papilla_proto::{ErrorCode, Problem};

pub(crate) use origin::cors;
pub(crate) use rate::network_of;
pub(crate) use tokens::{Holder, Tokens};

use self::rate::{Key, Rates};
use crate::{
    config::{Config, SettingError},
    core::metrics::Shed,
    telemetry,
    transport::{app::App, http, net::Standing},
};

/// Cookie that carries the token of a browser.
const COOKIE: &str = "papilla_token";

/// Routes that ask for no token: they tell nothing, or are what a browser loads before it can
/// send one.
const PUBLIC: [&str; 7] =
    ["/", "/{file}", "/healthz", "/readyz", "/openapi.json", "/v2/health/live", "/v2/health/ready"];

/// Whether a route asks for no token.
fn is_public(route: &str) -> bool {
    PUBLIC.contains(&route) || http::xr::PATHS.contains(&route)
}

/// Browsers cannot put a token into a header here.
const WEBSOCKET: &str = "/v1/session";

/// The address at the other end of the connection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Peer(pub(crate) IpAddr);

/// Who sent a request.
#[derive(Debug, Clone)]
pub(crate) struct Guest {
    /// Whose token it is.
    pub(crate) holder: Option<Arc<Holder>>,
    /// Whether it may change what the service serves.
    pub(crate) is_admin: bool,
}

/// What decides who comes in.
pub(crate) struct Gate {
    tokens: Option<Tokens>,
    origins: Vec<String>,
    rates: Option<Rates>,
    /// Reached from this machine alone.
    is_local: bool,
    is_tls: bool,
}

/// What becomes of a request that is let in.
enum Entry {
    Pass,
    /// The browser gets its token as a cookie and is sent to the page without it.
    Welcome(HeaderValue),
}

impl Gate {
    /// Reads the tokens.
    ///
    /// # Errors
    /// The file cannot be used.
    pub(crate) fn new(config: &Config) -> Result<Self, SettingError> {
        let tokens = config.tokens.as_deref().map(Tokens::read).transpose();
        let tokens = tokens.map_err(|reason| SettingError { field: "tokens", reason })?;
        Ok(Self {
            tokens,
            origins: config.allow_origin.clone(),
            rates: Rates::new(config.rate_per_s, config.rate_burst),
            is_local: config.bind.ip().is_loopback(),
            is_tls: config.tls_cert.is_some(),
        })
    }

    /// Who is let in, in words.
    pub(crate) fn describe(&self) -> String {
        match (&self.tokens, self.is_local) {
            (Some(tokens), _) => format!("{} tokens", tokens.len()),
            (None, true) => "none asked for; only this machine gets here".to_owned(),
            (None, false) => "none asked for; anyone who gets here is let in".to_owned(),
        }
    }

    fn admit(&self, request: &mut Request, route: &str) -> Result<Entry, Problem> {
        let headers = request.headers();
        let peer = request.extensions().get::<Peer>().map(|peer| peer.0);
        let query = if matches!(route, "/" | WEBSOCKET) { request.uri().query() } else { None };
        let in_query = query.and_then(token_in_query);
        let shown = in_query.as_deref().or_else(|| token_in_headers(headers));
        let holder = match (&self.tokens, shown) {
            (Some(tokens), Some(shown)) => tokens.holder(shown),
            _ => None,
        };
        if let (Some(_), Some(standing)) = (&holder, request.extensions().get::<Arc<Standing>>()) {
            standing.on_token();
        }
        let key = match (&holder, peer) {
            (Some(holder), _) => Some(Key::Token(Arc::clone(&holder.name))),
            (None, Some(address)) => Some(Key::of_address(address)),
            (None, None) => None,
        };
        if let (Some(rates), Some(key)) = (&self.rates, key) {
            rates.check(&key)?;
        }
        origin::check_host(request, &self.origins, self.is_local)?;
        origin::check(headers, &self.origins, self.is_local)?;
        let is_known = self.tokens.is_none() || holder.is_some();
        if !is_known && (in_query.is_some() || !is_public(route)) {
            let message = "a token is asked for here: Authorization: Bearer TOKEN";
            return Err(Problem::new(ErrorCode::Unauthorized, message).at("authorization"));
        }
        let entry = match (&holder, &in_query) {
            (Some(_), Some(token)) if route == "/" => Entry::Welcome(self.cookie(token)?),
            _ => Entry::Pass,
        };
        let is_admin = match &holder {
            Some(holder) => holder.is_admin,
            None => self.tokens.is_none() && peer.is_some_and(|peer| peer.is_loopback()),
        };
        request.extensions_mut().insert(Guest { holder, is_admin });
        Ok(entry)
    }

    fn cookie(&self, token: &str) -> Result<HeaderValue, Problem> {
        let secure = if self.is_tls { "; Secure" } else { "" };
        let cookie = format!("{COOKIE}={token}; Path=/; HttpOnly; SameSite=Strict{secure}");
        HeaderValue::from_str(&cookie)
            .map_err(|_| Problem::new(ErrorCode::Unauthorized, "the token is no token"))
    }
}

/// Every request comes through here; what is refused never reaches its handler.
pub(crate) async fn guard(
    State(app): State<Arc<App>>,
    mut request: Request,
    next: Next,
) -> Response {
    let start = Instant::now();
    let route = request.extensions().get::<MatchedPath>();
    let route = route.and_then(|path| http::known_route(path.as_str())).unwrap_or("other");
    let uri = request.uri().clone();
    let span = telemetry::request_span(request.method(), route);
    let response = match app.gate.admit(&mut request, route) {
        Ok(Entry::Pass) => telemetry::within(&span, next.run(request)).await,
        Ok(Entry::Welcome(cookie)) => welcome(cookie),
        Err(problem) => {
            if problem.code == ErrorCode::RateLimited {
                app.metrics.shed(Shed::Rate);
            }
            http::refusal(&app, &uri, problem)
        }
    };
    telemetry::answered(&span, response.status());
    app.metrics.request(route, response.status().as_u16(), start.elapsed());
    response
}

fn welcome(cookie: HeaderValue) -> Response {
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::SEE_OTHER;
    let headers = response.headers_mut();
    headers.insert(header::SET_COOKIE, cookie);
    headers.insert(header::LOCATION, HeaderValue::from_static("/"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

/// RFC 6750 2.3: for browsers, which cannot put a header on a WebSocket.
fn token_in_query(query: &str) -> Option<String> {
    let mut pairs = form_urlencoded::parse(query.as_bytes());
    pairs.find(|(name, _)| name == "access_token").map(|(_, token)| token.into_owned())
}

fn token_in_headers(headers: &HeaderMap) -> Option<&str> {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    if let Some(authorization) = text(header::AUTHORIZATION) {
        let (scheme, token) = authorization.split_once(' ').unwrap_or((authorization, ""));
        // Another scheme is a wrong token, not none.
        return Some(if scheme.eq_ignore_ascii_case("bearer") { token.trim() } else { "" });
    }
    let cookies = text(header::COOKIE)?.split(';');
    cookies
        .filter_map(|cookie| cookie.trim().split_once('='))
        .find(|(n, _)| *n == COOKIE)
        .map(|(_, t)| t)
}
