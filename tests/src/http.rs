//! A plain HTTP/1.1 client: one request a connection.

use std::{io, time::Duration};

use papilla_client::dial;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    time::timeout,
};

/// Longest wait for an answer, s.
const PATIENCE_S: u64 = 60;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum HttpError {
    /// Nobody listens, or the connection broke.
    #[error("{server}: {source}; is the service running there?")]
    Io {
        /// Host and port.
        server: String,
        /// What the system says.
        source: io::Error,
    },
    /// No answer in time.
    #[error("{server} has not answered {path} for {seconds} s")]
    Timeout {
        /// Host and port.
        server: String,
        /// Path asked for.
        path: String,
        /// Time waited, s.
        seconds: u64,
    },
    /// The answer is not HTTP, or breaks off.
    #[error("the answer of {server} to {path} is no whole HTTP answer: {reason}")]
    Malformed {
        /// Host and port.
        server: String,
        /// Path asked for.
        path: String,
        /// What is wrong with it.
        reason: &'static str,
    },
}

/// A request.
#[derive(Clone, Debug)]
pub struct Request {
    method: &'static str,
    path: String,
    headers: Vec<(String, String)>,
    body: Option<Vec<u8>>,
}

impl Request {
    /// A GET of `path`, query included.
    #[must_use]
    pub fn get(path: &str) -> Self {
        Self { method: "GET", path: path.to_owned(), headers: Vec::new(), body: None }
    }

    /// A POST of `body` to `path`, query included.
    #[must_use]
    pub fn post(path: &str, body: impl Into<Vec<u8>>) -> Self {
        Self { method: "POST", body: Some(body.into()), ..Self::get(path) }
    }

    /// Adds a header.
    #[must_use]
    pub fn header(mut self, name: &str, value: &str) -> Self {
        self.headers.push((name.to_owned(), value.to_owned()));
        self
    }

    /// Sends it to `server` (host and port) and waits for the whole answer.
    ///
    /// # Errors
    /// [`HttpError`]; an answer with an error status is an answer.
    pub async fn send(&self, server: &str) -> Result<Response, HttpError> {
        let exchange = async {
            let mut stream = dial(server).await?;
            let mut answer = Vec::new();
            // A server that has heard enough answers and closes before all is written: what
            // it says matters more than the pipe that broke.
            let written = stream.write_all(&self.encode(server)).await;
            let read = stream.read_to_end(&mut answer).await;
            if answer.is_empty() {
                written.and(read)?;
            }
            Ok::<_, io::Error>(answer)
        };
        let answer = match timeout(Duration::from_secs(PATIENCE_S), exchange).await {
            Ok(answer) => {
                answer.map_err(|source| HttpError::Io { server: server.to_owned(), source })?
            }
            Err(_) => {
                let (server, path) = (server.to_owned(), self.path.clone());
                return Err(HttpError::Timeout { server, path, seconds: PATIENCE_S });
            }
        };
        Response::parse(&answer).map_err(|reason| {
            let (server, path) = (server.to_owned(), self.path.clone());
            HttpError::Malformed { server, path, reason }
        })
    }

    fn encode(&self, server: &str) -> Vec<u8> {
        let Self { method, path, .. } = self;
        let mut head =
            format!("{method} {path} HTTP/1.1\r\nhost: {server}\r\nconnection: close\r\n");
        for (name, value) in &self.headers {
            head += &format!("{name}: {value}\r\n");
        }
        if let Some(body) = &self.body {
            head += &format!("content-length: {}\r\n", body.len());
        }
        let mut bytes = (head + "\r\n").into_bytes();
        bytes.extend_from_slice(self.body.as_deref().unwrap_or_default());
        bytes
    }
}

/// An answer.
#[derive(Clone, Debug)]
pub struct Response {
    /// Status code.
    pub status: u16,
    /// Names in lower case, values as they came.
    headers: Vec<(String, String)>,
    /// Body.
    pub body: Vec<u8>,
}

impl Response {
    fn parse(bytes: &[u8]) -> Result<Self, &'static str> {
        let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").ok_or("its head has no end")?;
        let head = std::str::from_utf8(&bytes[..end]).map_err(|_| "its head is not text")?;
        let mut lines = head.lines();
        let status = lines.next().and_then(|line| line.strip_prefix("HTTP/1.1 "));
        let status =
            status.and_then(|line| line.get(..3)?.parse().ok()).ok_or("it has no status")?;
        let split = |line: &str| {
            let (name, value) = line.split_once(':')?;
            Some((name.to_ascii_lowercase(), value.trim().to_owned()))
        };
        let headers: Vec<_> = lines.filter_map(split).collect();
        let answer = Self { status, headers, body: bytes[end + 4..].to_vec() };
        match answer.header("content-length").and_then(|length| length.parse::<usize>().ok()) {
            Some(length) if answer.body.len() == length => Ok(answer),
            Some(_) => Err("its body has another length than announced"),
            None => Err("its length is not announced"),
        }
    }

    /// The value of a header; `name` in lower case.
    #[must_use]
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// The body as text, for messages.
    #[must_use]
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_read_and_broken_ones_refused() {
        let answer =
            Response::parse(b"HTTP/1.1 404 Not Found\r\nContent-Length: 2\r\n\r\nno").unwrap();
        assert_eq!((answer.status, answer.text().as_str()), (404, "no"));
        assert_eq!(answer.header("content-length"), Some("2"));
        for broken in [
            "HTTP/1.1 200 OK\r\ncontent-length: 3\r\n\r\nno",
            "HTTP/1.1 200 OK\r\n\r\n",
            "HTTP/1.1 OK\r\ncontent-length: 0\r\n\r\n",
            "HTTP/1.1 200 OK\r\ncontent-length: 0\r\n",
            "",
        ] {
            assert!(Response::parse(broken.as_bytes()).is_err(), "{broken}");
        }
    }

    #[test]
    fn requests_are_written_as_http_wants_them() {
        let request = Request::post("/v1/sed", b"abc".as_slice()).header("accept", "image/png");
        let due = "POST /v1/sed HTTP/1.1\r\nhost: h:1\r\nconnection: close\r\naccept: image/png\r\n\
                   content-length: 3\r\n\r\nabc";
        assert_eq!(String::from_utf8(request.encode("h:1")).unwrap(), due);
    }
}
