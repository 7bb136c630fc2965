//! Which format the client sends, and which it wants back: `Content-Type`, `Accept` and the query.

use axum::http::{HeaderMap, header};
use papilla_codec::{Input, Output, is_npy, is_png};
use papilla_proto::{ErrorCode, MAP_LEN, Problem, SampleType, error::shortened};

/// The answer types, best first.
const OFFERED: [Output; 4] =
    [Output::Samples(SampleType::F32), Output::Npy, Output::Png, Output::Json];

/// The parameters of `POST /v1/sed`.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Query {
    /// Finger by name.
    pub(crate) finger: Option<String>,
    /// Tier by name.
    pub(crate) tier: Option<String>,
    /// Time the map may spend in the server, us.
    pub(crate) budget_us: Option<u32>,
    /// Pressure of full white of a PNG, Pa.
    pub(crate) pressure_max_pa: Option<f32>,
}

fn bad_query(field: &str, message: impl Into<String>) -> Problem {
    Problem::new(ErrorCode::BadQuery, message).at(field)
}

impl Query {
    /// Reads the part of the address after `?`.
    ///
    /// # Errors
    /// A parameter is unknown, given twice or malformed.
    pub(crate) fn parse(query: &str) -> Result<Self, Problem> {
        let mut parsed = Self::default();
        for (name, value) in form_urlencoded::parse(query.as_bytes()) {
            let twice = match &*name {
                "finger" => parsed.finger.replace(value.into_owned()).is_some(),
                "tier" => parsed.tier.replace(value.into_owned()).is_some(),
                "budget_us" => {
                    let budget = value.parse().map_err(|_| {
                        let value = shortened(&value);
                        bad_query(&name, format!("'{value}' is not a whole number of microseconds"))
                    })?;
                    parsed.budget_us.replace(budget).is_some()
                }
                "pressure_max_pa" => {
                    let pressure = value.parse().ok().filter(|p: &f32| p.is_finite() && *p > 0.0);
                    let pressure = pressure.ok_or_else(|| {
                        let value = shortened(&value);
                        bad_query(&name, format!("'{value}' is not a pressure above 0 Pa"))
                    })?;
                    parsed.pressure_max_pa.replace(pressure).is_some()
                }
                _ => {
                    let known = "finger, tier, budget_us and pressure_max_pa";
                    let name = shortened(&name);
                    return Err(bad_query(&name, format!("no parameter '{name}'; known: {known}")));
                }
            };
            if twice {
                return Err(bad_query(&name, format!("'{name}' is given twice")));
            }
        }
        Ok(parsed)
    }

    /// The budget, none if it is 0.
    pub(crate) fn budget(&self) -> Option<u32> {
        self.budget_us.filter(|&us| us > 0)
    }
}

/// The form of the body.
///
/// No type, and the type `curl --data-binary` sends unasked, leave it to the body itself.
///
/// # Errors
/// A type that is not taken here, or a PNG without `pressure_max_pa`.
pub(crate) fn input(headers: &HeaderMap, query: &Query, body: &[u8]) -> Result<Input, Problem> {
    let raw = Input::Samples { sample_type: SampleType::F32, scale: 1.0 };
    let png = || {
        let pressure_max_pa = query.pressure_max_pa.ok_or_else(|| {
            let message = "a PNG needs ?pressure_max_pa=, the pressure of full white, Pa";
            bad_query("pressure_max_pa", message)
        })?;
        Ok(Input::Png { pressure_max_pa })
    };
    let content_type = headers.get(header::CONTENT_TYPE).map_or(Ok(""), |v| v.to_str());
    let essence = content_type.unwrap_or("?").split(';').next().unwrap_or_default().trim();
    match essence.to_ascii_lowercase().as_str() {
        "application/octet-stream" => Ok(raw),
        "application/x-npy" => Ok(Input::Npy),
        "application/json" => Ok(Input::Json),
        "image/png" => png(),
        "" | "application/x-www-form-urlencoded" => {
            if body.len() == MAP_LEN * 4 {
                Ok(raw)
            } else if is_png(body) {
                png()
            } else if is_npy(body) {
                Ok(Input::Npy)
            } else if body.trim_ascii_start().starts_with(b"{") {
                Ok(Input::Json)
            } else {
                Ok(raw)
            }
        }
        other => {
            let other = shortened(other);
            let message = format!(
                "'{other}' is not taken here; send application/octet-stream, application/x-npy, \
                 image/png or application/json"
            );
            Err(Problem::new(ErrorCode::WrongType, message).at("content-type"))
        }
    }
}

/// The form of the answer: the offered type that `Accept` ranks highest.
///
/// # Errors
/// Every offered type is excluded.
pub(crate) fn output(headers: &HeaderMap) -> Result<Output, Problem> {
    let mut ranges = Vec::new();
    for value in headers.get_all(header::ACCEPT) {
        ranges.extend(value.to_str().unwrap_or_default().split(',').map(Range::parse));
    }
    if ranges.is_empty() {
        return Ok(OFFERED[0]);
    }
    let mut best = None;
    for output in OFFERED {
        let quality = quality(&ranges, output.content_type());
        // Strictly greater: of equals the first offered wins.
        if quality > best.map_or(0.0, |(_, q)| q) {
            best = Some((output, quality));
        }
    }
    best.map(|(output, _)| output).ok_or_else(|| {
        let offered = OFFERED.map(Output::content_type).join(", ");
        Problem::new(ErrorCode::NotAcceptable, format!("offered are {offered}")).at("accept")
    })
}

/// Whether `Accept-Encoding` takes gzip, RFC 9110 12.5.3.
pub(crate) fn takes_gzip(headers: &HeaderMap) -> bool {
    let values = headers.get_all(header::ACCEPT_ENCODING).iter();
    let codings: Vec<Range<'_>> = values
        .flat_map(|value| value.to_str().unwrap_or_default().split(',').map(Range::parse))
        .collect();
    let quality = |name: &str| {
        codings.iter().find(|c| c.kind.eq_ignore_ascii_case(name)).map(|coding| coding.quality)
    };
    // By its name, or else as any.
    quality("gzip").or_else(|| quality("*")).is_some_and(|quality| quality > 0.0)
}

/// One member of `Accept`, RFC 9110 12.5.1.
struct Range<'a> {
    kind: &'a str,
    quality: f32,
}

impl<'a> Range<'a> {
    fn parse(text: &'a str) -> Self {
        let mut parts = text.split(';').map(str::trim);
        let kind = parts.next().unwrap_or_default();
        let quality = parts
            .find_map(|p| p.strip_prefix("q=").or_else(|| p.strip_prefix("Q=")))
            .map_or(1.0, |q| q.parse().unwrap_or(0.0));
        Self { kind, quality }
    }

    /// How narrowly the range names `content_type`: 3 exactly, 2 by its family, 1 as anything.
    fn fit(&self, content_type: &str) -> Option<u8> {
        if self.kind.eq_ignore_ascii_case(content_type) {
            return Some(3);
        }
        match self.kind.split_once('/')? {
            ("*", "*") => Some(1),
            (family, "*") => content_type
                .split_once('/')
                .is_some_and(|(f, _)| f.eq_ignore_ascii_case(family))
                .then_some(2),
            _ => None,
        }
    }
}

/// The quality the narrowest fitting range gives; 0 if none fits.
fn quality(ranges: &[Range<'_>], content_type: &str) -> f32 {
    ranges
        .iter()
        .filter_map(|range| Some((range.fit(content_type)?, range.quality)))
        .max_by_key(|&(fit, _)| fit)
        .map_or(0.0, |(_, quality)| quality)
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;
    use proptest::prelude::*;

    use super::*;

    fn accepting(accept: &str) -> Result<Output, ErrorCode> {
        let mut headers = HeaderMap::new();
        headers.insert(header::ACCEPT, HeaderValue::from_str(accept).unwrap());
        output(&headers).map_err(|problem| problem.code)
    }

    #[test]
    fn the_narrowest_range_decides_and_quality_ranks() {
        let raw = Output::Samples(SampleType::F32);
        for (accept, expected) in [
            ("*/*", raw),
            ("application/*", raw),
            ("image/*", Output::Png),
            ("image/png", Output::Png),
            ("IMAGE/PNG", Output::Png),
            ("application/json, */*;q=0.1", Output::Json),
            ("application/x-npy;q=0.5, image/png;q=0.4", Output::Npy),
            ("application/octet-stream;q=0, */*", Output::Npy),
            ("text/html, image/avif, image/webp, */*;q=0.8", raw),
        ] {
            assert_eq!(accepting(accept), Ok(expected), "{accept}");
        }
        for accept in ["text/html", "*/*;q=0", "image/png;q=x", "", ";", "image"] {
            assert_eq!(accepting(accept), Err(ErrorCode::NotAcceptable), "{accept}");
        }
        assert_eq!(output(&HeaderMap::new()).unwrap(), raw);
    }

    fn sending(content_type: Option<&str>, query: &str, body: &[u8]) -> Result<Input, ErrorCode> {
        let mut headers = HeaderMap::new();
        if let Some(content_type) = content_type {
            headers.insert(header::CONTENT_TYPE, HeaderValue::from_str(content_type).unwrap());
        }
        Query::parse(query).and_then(|q| input(&headers, &q, body)).map_err(|problem| problem.code)
    }

    #[test]
    fn a_body_without_a_type_speaks_for_itself() {
        let raw = Input::Samples { sample_type: SampleType::F32, scale: 1.0 };
        let form = Some("application/x-www-form-urlencoded");
        for content_type in [None, form] {
            assert_eq!(sending(content_type, "", b"\x93NUMPY\x01"), Ok(Input::Npy));
            assert_eq!(sending(content_type, "", b" {\"pressure_pa\""), Ok(Input::Json));
            assert_eq!(sending(content_type, "", b"1234"), Ok(raw));
            let png = b"\x89PNG\r\n\x1a\n";
            assert_eq!(sending(content_type, "", png), Err(ErrorCode::BadQuery));
            assert_eq!(
                sending(content_type, "pressure_max_pa=5", png),
                Ok(Input::Png { pressure_max_pa: 5.0 })
            );
        }
        // A map whose first pressure happens to look like a brace is still a map.
        assert_eq!(sending(None, "", &vec![b'{'; MAP_LEN * 4]), Ok(raw));
    }

    #[test]
    fn a_named_type_is_taken_at_its_word() {
        assert_eq!(sending(Some("Application/JSON; charset=utf-8"), "", b"x"), Ok(Input::Json));
        assert_eq!(sending(Some("image/png"), "", b""), Err(ErrorCode::BadQuery));
        for other in ["text/plain", "image/jpeg", "application/", "?"] {
            assert_eq!(sending(Some(other), "", b""), Err(ErrorCode::WrongType), "{other}");
        }
    }

    #[test]
    fn queries() {
        let all = Query::parse("tier=s1%2Dbase8&budget_us=11000&pressure_max_pa=2.5e4").unwrap();
        assert_eq!(all.tier.as_deref(), Some("s1-base8"));
        assert_eq!((all.budget(), all.pressure_max_pa), (Some(11_000), Some(25_000.0)));
        assert_eq!(Query::parse("budget_us=0").unwrap().budget(), None);
        for bad in [
            "teir=x",
            "tier=a&tier=b",
            "budget_us=-1",
            "budget_us=1.5",
            "budget_us=",
            "budget_us",
            "pressure_max_pa=0",
            "pressure_max_pa=nan",
            "pressure_max_pa=inf",
            "x",
        ] {
            assert_eq!(Query::parse(bad).unwrap_err().code, ErrorCode::BadQuery, "{bad}");
        }
    }

    proptest! {
        #[test]
        fn text_of_any_kind_does_not_panic(text in "[ -~]{0,60}") {
            let _ = accepting(&text);
            let _ = sending(Some(&text), &text, text.as_bytes());
        }
    }
}
