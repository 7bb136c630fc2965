//! Who may come in: tokens, origins, rates, and places for connections. It holds the rules only,
//! and uses neither routes nor handlers.

mod origin;
mod places;
mod rate;
mod tokens;

use std::{net::IpAddr, sync::Arc};

use axum::http::{HeaderMap, HeaderValue, header, request::Parts};
use papilla_proto::{ErrorCode, Problem};

pub(crate) use self::{
    origin::cors,
    places::{Place, PlaceHandle, Places},
    rate::Key,
    tokens::Holder,
};
use self::{rate::Rates, tokens::Tokens};
use crate::config::{Config, SettingError};

/// Cookie that carries the token of a browser.
const COOKIE: &str = "papilla_token";

/// What a route asks of those who come in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RouteAccess {
    /// It asks for no token.
    pub(crate) is_public: bool,
    pub(crate) token_in_query: TokenInQuery,
}

/// What becomes of a token in the query, where browsers cannot put it into a header (RFC 6750 2.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TokenInQuery {
    Ignored,
    Taken,
    /// The browser gets it as a cookie instead.
    Exchanged,
}

/// The address at the other end of the connection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Peer(pub(crate) IpAddr);

/// Who sent a request.
#[derive(Debug, Clone)]
pub(crate) struct Principal {
    /// Whose token it is.
    pub(crate) holder: Option<Arc<Holder>>,
    /// Whether it may change what the service serves.
    pub(crate) is_admin: bool,
    /// The client that it counts for, if that is known.
    pub(crate) client: Option<Key>,
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

/// A request that is let in.
pub(crate) struct Admitted {
    pub(crate) principal: Principal,
    /// Its token as a cookie: the browser is to go on without it in the query.
    pub(crate) cookie: Option<HeaderValue>,
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

    /// Whether a request may come in, by its head. Of the connection, [`Peer`] and [`PlaceHandle`]
    /// are among the head's extensions.
    ///
    /// # Errors
    /// The refusal: too many requests, a stranger's page or host, no token.
    pub(crate) fn admit(&self, head: &Parts, route: RouteAccess) -> Result<Admitted, Problem> {
        let peer = head.extensions.get::<Peer>().map(|peer| peer.0);
        let is_query_read = route.token_in_query != TokenInQuery::Ignored;
        let query = head.uri.query().filter(|_| is_query_read);
        let in_query = query.and_then(token_in_query);
        let shown = in_query.as_deref().or_else(|| token_in_headers(&head.headers));
        let holder = match (&self.tokens, shown) {
            (Some(tokens), Some(shown)) => tokens.holder(shown),
            _ => None,
        };
        if let (Some(_), Some(handle)) = (&holder, head.extensions.get::<Arc<PlaceHandle>>()) {
            handle.on_token();
        }
        let key = match (&holder, peer) {
            (Some(holder), _) => Some(Key::Token(Arc::clone(&holder.name))),
            (None, Some(address)) => Some(Key::of_address(address)),
            (None, None) => None,
        };
        if let (Some(rates), Some(key)) = (&self.rates, &key) {
            rates.check(key)?;
        }
        origin::check_host(head, &self.origins, self.is_local)?;
        origin::check(&head.headers, &self.origins, self.is_local)?;
        let is_known = self.tokens.is_none() || holder.is_some();
        if !is_known && (in_query.is_some() || !route.is_public) {
            let is_in_query = head.uri.query().and_then(token_in_query).is_some();
            let message = match (shown.is_some(), is_in_query && !is_query_read) {
                (_, true) => {
                    "a token in the address is taken by / and /v1/session alone, since addresses are \
                     written into logs; send it as a header here: Authorization: Bearer TOKEN"
                }
                (true, false) => {
                    "this token is none of this service's; is it whole, and without spaces or line \
                     ends? It is sent as a header: Authorization: Bearer TOKEN"
                }
                (false, false) => "a token is asked for here: Authorization: Bearer TOKEN",
            };
            return Err(Problem::new(ErrorCode::Unauthorized, message).at("authorization"));
        }
        let cookie = match (&holder, &in_query) {
            (Some(_), Some(token)) if route.token_in_query == TokenInQuery::Exchanged => {
                Some(self.cookie(token)?)
            }
            _ => None,
        };
        let is_admin = match &holder {
            Some(holder) => holder.is_admin,
            None => self.tokens.is_none() && peer.is_some_and(|peer| peer.is_loopback()),
        };
        Ok(Admitted { principal: Principal { holder, is_admin, client: key }, cookie })
    }

    fn cookie(&self, token: &str) -> Result<HeaderValue, Problem> {
        let secure = if self.is_tls { "; Secure" } else { "" };
        // Without a path it is of the folder that was asked for, which a proxy may have put in front.
        let cookie = format!("{COOKIE}={token}; HttpOnly; SameSite=Strict{secure}");
        HeaderValue::from_str(&cookie)
            .map_err(|_| Problem::new(ErrorCode::Unauthorized, "the token is no token"))
    }
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
