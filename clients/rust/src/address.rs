//! Addresses of a service, as every client takes them (docs/reference/clients/README.md), with its token.

use std::{fmt, str::FromStr};

use crate::PapillaError;

/// The service's port, where an address names neither a port nor a scheme.
const PORT: u16 = 7224;

/// Where a service is: its host, its port, whether by TLS, and the path in front of its own.
///
/// Read from `host`, `host:port`, or a URL of http, https, ws or wss.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    secure: bool,
    host: String,
    port: u16,
    path: String,
    token: Option<Token>,
}

/// A bearer token. Logs do not show it.
#[derive(Clone, PartialEq, Eq)]
struct Token(String);

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

/// What names a service: text that an [`Address`] can be read from, or one with a token.
pub trait ToAddress {
    /// The address.
    ///
    /// # Errors
    /// [`PapillaError::Address`].
    fn to_address(&self) -> Result<Address, PapillaError>;
}

impl ToAddress for str {
    fn to_address(&self) -> Result<Address, PapillaError> {
        self.parse()
    }
}

impl ToAddress for String {
    fn to_address(&self) -> Result<Address, PapillaError> {
        self.parse()
    }
}

impl ToAddress for Address {
    fn to_address(&self) -> Result<Address, PapillaError> {
        Ok(self.clone())
    }
}

impl FromStr for Address {
    type Err = PapillaError;

    fn from_str(text: &str) -> Result<Self, PapillaError> {
        read(text.trim_ascii())
            .map_err(|why| PapillaError::Address { address: text.to_owned(), why })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.http(""))
    }
}

impl Address {
    /// URL of one of the service's paths.
    #[must_use]
    pub fn http(&self, path: &str) -> String {
        self.url("http", path)
    }

    /// URL of sessions.
    #[must_use]
    pub fn session(&self) -> String {
        self.url("ws", "/v1/session")
    }

    /// With a bearer token, for a service that asks for one. Blanks and line ends around it go, as files
    /// have them.
    ///
    /// # Errors
    /// [`PapillaError::Token`]: others are inside.
    pub fn with_token(self, token: &str) -> Result<Self, PapillaError> {
        let token = token.trim_ascii();
        if !token.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Err(PapillaError::Token);
        }
        let token = (!token.is_empty()).then(|| Token(token.to_owned()));
        Ok(Self { token, ..self })
    }

    /// What a request says of the token.
    pub(crate) fn authorization(&self) -> Option<String> {
        self.token.as_ref().map(|Token(token)| format!("Bearer {token}"))
    }

    /// Host and port, for a connection.
    pub(crate) fn to_dial(&self) -> String {
        format!("{}:{}", self.bracketed(), self.port)
    }

    /// This client speaks no TLS.
    pub(crate) fn plain(self) -> Result<Self, PapillaError> {
        if self.secure {
            let why = "this client speaks no TLS: put a proxy in front, or take another client";
            return Err(PapillaError::Address { address: self.to_string(), why });
        }
        Ok(self)
    }

    fn bracketed(&self) -> String {
        if self.host.contains(':') { format!("[{}]", self.host) } else { self.host.clone() }
    }

    fn url(&self, scheme: &str, path: &str) -> String {
        let (s, default) = if self.secure { ("s", 443) } else { ("", 80) };
        let port = if self.port == default { String::new() } else { format!(":{}", self.port) };
        format!("{scheme}{s}://{}{port}{}{path}", self.bracketed(), self.path)
    }
}

fn read(text: &str) -> Result<Address, &'static str> {
    if text.is_empty() {
        return Err("it is empty");
    }
    let is_odd = |c: char| !c.is_ascii_graphic() || "\"<>\\^`{|}".contains(c);
    if text.contains(is_odd) {
        return Err("it holds a blank or another character that no address has");
    }
    let (secure, default, rest) = match text.split_once("://") {
        None => (false, PORT, text),
        Some((scheme, rest)) => match scheme.to_ascii_lowercase().as_str() {
            "http" | "ws" => (false, 80, rest),
            "https" | "wss" => (true, 443, rest),
            _ => return Err("its scheme is none of http, https, ws, wss"),
        },
    };
    if rest.contains(['?', '#']) {
        return Err("nothing can follow a '?' or '#'; a token is an argument of its own");
    }
    let (authority, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
    if authority.contains('@') {
        return Err("it holds a user or a password; a token is an argument of its own");
    }
    let (host, port) = split(authority)?;
    let port = match port {
        None => default,
        Some(port) if port.len() < 6 && port.bytes().all(|byte| byte.is_ascii_digit()) => {
            port.parse().unwrap_or(0)
        }
        Some(_) => 0,
    };
    if port == 0 {
        return Err("its port is no number from 1 to 65535");
    }
    let path = path.trim_end_matches('/').to_owned();
    Ok(Address { secure, host: host.to_owned(), port, path, token: None })
}

/// Host, without brackets, and port, if there is one.
fn split(authority: &str) -> Result<(&str, Option<&str>), &'static str> {
    if let Some(inside) = authority.strip_prefix('[') {
        let due = "in brackets stands an IPv6 address, as [::1]:7224";
        let (host, after) = inside.split_once(']').ok_or(due)?;
        let is_ipv6 = host.matches(':').count() > 1
            && host.bytes().all(|byte| byte.is_ascii_hexdigit() || b":.".contains(&byte));
        return match after.strip_prefix(':') {
            _ if !is_ipv6 => Err(due),
            Some(port) => Ok((host, Some(port))),
            None if after.is_empty() => Ok((host, None)),
            None => Err(due),
        };
    }
    if authority.matches(':').count() > 1 {
        return Err("an IPv6 address stands in brackets, as [::1]:7224");
    }
    let (host, port) = match authority.split_once(':') {
        Some((host, port)) => (host, Some(port)),
        None => (authority, None),
    };
    let is_host = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
    if host.is_empty() || !host.bytes().all(is_host) {
        return Err("its host is missing or has a character that no host has");
    }
    Ok((host, port))
}
