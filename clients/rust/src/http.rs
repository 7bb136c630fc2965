//! One map over HTTP, and the atlas. Blocking.

use std::time::Duration;

use papilla_proto::{ErrorCode, MAP_LEN, Problem, SampleError, SampleType, atlas::Atlas};
use ureq::{Body, http};

use crate::{Address, PapillaError, ToAddress, error::problem_of};

/// Longest wait for an answer: as long as a request may wait for models that are being loaded.
const PATIENCE: Duration = Duration::from_secs(30);

/// A map that came over HTTP.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// 224 x 224, row-major, J/m3.
    pub sed_j_per_m3: Vec<f32>,
    /// Name of the tier that rendered.
    pub tier: String,
}

/// What a path of the service at `server` (an [`Address`]) answers.
///
/// # Errors
/// `server` is no address, nobody listens, or the service refuses.
pub fn get(server: &(impl ToAddress + ?Sized), path: &str) -> Result<Vec<u8>, PapillaError> {
    let address = server.to_address()?.plain()?;
    let mut request = agent().get(address.http(path));
    if let Some(authorization) = address.authorization() {
        request = request.header("authorization", authorization);
    }
    let answer = request.call();
    body(&address, answer).map(|(_, body)| body)
}

/// The atlas of the default finger of the service at `server`.
///
/// # Errors
/// As [`get`], or the atlas is damaged.
pub fn atlas(server: &(impl ToAddress + ?Sized)) -> Result<Atlas, PapillaError> {
    atlas_at(server, "/v1/atlas")
}

/// The atlas of another finger of that service, by its name.
///
/// # Errors
/// As [`get`], or the atlas is damaged.
pub fn atlas_of(server: &(impl ToAddress + ?Sized), finger: &str) -> Result<Atlas, PapillaError> {
    atlas_at(server, &format!("/v1/atlas?finger={}", escaped(finger)))
}

/// What is no name of a finger is refused, and stays one parameter.
fn escaped(finger: &str) -> String {
    finger.bytes().map(|byte| format!("%{byte:02x}")).collect()
}

fn atlas_at(server: &(impl ToAddress + ?Sized), path: &str) -> Result<Atlas, PapillaError> {
    let text = String::from_utf8_lossy(&get(server, path)?).into_owned();
    Ok(Atlas::from_json(&text)?)
}

/// SED of one pressure map (224 x 224, Pa) on the default finger, with the tier of that name or the
/// service's default.
///
/// # Errors
/// Nobody listens, or the service refuses the map: [`PapillaError::code`] says why.
pub fn sed(
    server: &(impl ToAddress + ?Sized),
    pressure_pa: &[f32],
    tier: Option<&str>,
) -> Result<Rendered, PapillaError> {
    sed_at(server, "/v1/sed", pressure_pa, tier)
}

/// The same on another finger of that service, by its name.
///
/// # Errors
/// As [`sed`], or the service has no such finger.
pub fn sed_of(
    server: &(impl ToAddress + ?Sized),
    finger: &str,
    pressure_pa: &[f32],
    tier: Option<&str>,
) -> Result<Rendered, PapillaError> {
    sed_at(server, &format!("/v1/sed?finger={}", escaped(finger)), pressure_pa, tier)
}

fn sed_at(
    server: &(impl ToAddress + ?Sized),
    path: &str,
    pressure_pa: &[f32],
    tier: Option<&str>,
) -> Result<Rendered, PapillaError> {
    let address = server.to_address()?.plain()?;
    let mut payload = vec![0; 4 * pressure_pa.len()];
    SampleType::F32.encode(pressure_pa, 1.0, &mut payload).map_err(protocol)?;
    let mut request = agent().post(address.http(path));
    if let Some(authorization) = address.authorization() {
        request = request.header("authorization", authorization);
    }
    if let Some(tier) = tier {
        request = request.query("tier", tier);
    }
    let octets = "application/octet-stream";
    let answer = request.header("content-type", octets).header("accept", octets).send(&payload);
    let (tier, body) = body(&address, answer)?;
    let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
    SampleType::F32.decode(&body, 1.0, &mut sed_j_per_m3).map_err(protocol)?;
    Ok(Rendered { sed_j_per_m3, tier })
}

fn agent() -> ureq::Agent {
    ureq::Agent::config_builder()
        .http_status_as_error(false)
        .proxy(None)
        .timeout_global(Some(PATIENCE))
        .build()
        .into()
}

fn protocol(error: SampleError) -> PapillaError {
    PapillaError::Protocol(error.to_string())
}

/// Tier and body of an answer.
fn body(
    address: &Address,
    answer: Result<http::Response<Body>, ureq::Error>,
) -> Result<(String, Vec<u8>), PapillaError> {
    let unreachable = |error: ureq::Error| PapillaError::unreachable(address, &error);
    let mut answer = answer.map_err(unreachable)?;
    let status = answer.status();
    let header = answer.headers().get("x-papilla-tier");
    let tier = header.and_then(|value| value.to_str().ok()).unwrap_or_default().to_owned();
    let body = answer.body_mut().read_to_vec().map_err(unreachable)?;
    if status.is_success() {
        return Ok((tier, body));
    }
    let unnamed = || Problem::new(ErrorCode::Internal, format!("status {status}"));
    Err(PapillaError::Refused(problem_of(&body).unwrap_or_else(unnamed)))
}

#[cfg(test)]
mod tests {
    use std::{
        io::{BufRead, BufReader, Read, Write},
        net::TcpListener,
        thread,
    };

    use super::*;

    /// The path of one request for a map, which is answered by zeros.
    fn asked(ask: impl FnOnce(&str) -> Rendered) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let service = thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut reader = BufReader::new(stream.try_clone().unwrap());
            let mut lines = Vec::new();
            loop {
                let mut line = String::new();
                reader.read_line(&mut line).unwrap();
                if line.trim().is_empty() {
                    break;
                }
                lines.push(line);
            }
            reader.read_exact(&mut vec![0; 4 * MAP_LEN]).unwrap();
            let head = format!(
                "HTTP/1.1 200 OK\r\nx-papilla-tier: own\r\ncontent-length: {}\r\n\r\n",
                4 * MAP_LEN
            );
            stream.write_all(head.as_bytes()).unwrap();
            stream.write_all(&vec![0; 4 * MAP_LEN]).unwrap();
            lines[0].split(' ').nth(1).unwrap().to_owned()
        });
        assert_eq!(ask(&address).tier, "own");
        service.join().unwrap()
    }

    #[test]
    fn a_map_is_asked_of_the_finger_that_is_named() {
        let zero = vec![0.0; MAP_LEN];
        let plain = asked(|server| sed(server, &zero, None).unwrap());
        assert_eq!(plain, "/v1/sed");
        let named = asked(|server| sed_of(server, "my&finger", &zero, Some("own")).unwrap());
        assert_eq!(named, "/v1/sed?finger=%6d%79%26%66%69%6e%67%65%72&tier=own");
    }
}
