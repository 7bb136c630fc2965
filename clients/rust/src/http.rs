//! One map over HTTP, and the atlas. Blocking.

use papilla_proto::{ErrorCode, MAP_LEN, Problem, SampleError, SampleType, atlas::Atlas};
use ureq::{Body, http};

use crate::{PapillaError, dial::host_and_port, error::problem_of};

/// A map that came over HTTP.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// 224 x 224, row-major, J/m3.
    pub sed_j_per_m3: Vec<f32>,
    /// Name of the tier that rendered.
    pub tier: String,
}

/// What a path of the service at `server` (host and port, or a URL) answers.
///
/// # Errors
/// Nobody listens, or the service refuses.
pub fn get(server: &str, path: &str) -> Result<Vec<u8>, PapillaError> {
    let server = host_and_port(server);
    let answer = agent().get(format!("http://{server}{path}")).call();
    body(server, answer).map(|(_, body)| body)
}

/// The atlas of the service at `server`.
///
/// # Errors
/// As [`get`], or the atlas is damaged.
pub fn atlas(server: &str) -> Result<Atlas, PapillaError> {
    let text = String::from_utf8_lossy(&get(server, "/v1/atlas")?).into_owned();
    Ok(Atlas::from_json(&text)?)
}

/// SED of one pressure map (224 x 224, Pa), with the tier of that name or the service's default.
///
/// # Errors
/// Nobody listens, or the service refuses the map: [`PapillaError::code`] says why.
pub fn sed(
    server: &str,
    pressure_pa: &[f32],
    tier: Option<&str>,
) -> Result<Rendered, PapillaError> {
    let server = host_and_port(server);
    let mut payload = vec![0; 4 * pressure_pa.len()];
    SampleType::F32.encode(pressure_pa, 1.0, &mut payload).map_err(protocol)?;
    let mut request = agent().post(format!("http://{server}/v1/sed"));
    if let Some(tier) = tier {
        request = request.query("tier", tier);
    }
    let octets = "application/octet-stream";
    let answer = request.header("content-type", octets).header("accept", octets).send(&payload);
    let (tier, body) = body(server, answer)?;
    let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
    SampleType::F32.decode(&body, 1.0, &mut sed_j_per_m3).map_err(protocol)?;
    Ok(Rendered { sed_j_per_m3, tier })
}

fn agent() -> ureq::Agent {
    ureq::Agent::config_builder().http_status_as_error(false).proxy(None).build().into()
}

fn protocol(error: SampleError) -> PapillaError {
    PapillaError::Protocol(error.to_string())
}

/// Tier and body of an answer.
fn body(
    server: &str,
    answer: Result<http::Response<Body>, ureq::Error>,
) -> Result<(String, Vec<u8>), PapillaError> {
    let unreachable = |error: ureq::Error| PapillaError::unreachable(server, &error);
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
