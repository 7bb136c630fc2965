//! Versions 1 and 2 of the protocol, held against what a build said that had only those.
//!
//! `server/tests/recorded/record` has made the recording; the models beside it multiply, so that
//! their answers are the same bits on every processor. Not compared, since they are of the run and
//! not of the protocol: in answers the times (bytes 24 to 27, in version 2 also 36 to 43), in texts
//! [`OF_THE_RUN`].
//!
//! What has changed since: answers of u16 and u8 have a scale of their own each, so that their maps
//! are compared as values, to half a unit; flag 16, cut off, is new in version 2, and masked;
//! firing rates have come into sections of their own, so that sessions [with them](has_rates) are not
//! compared; and [`CHANGED`].

use std::{fs, io::Read, path::Path};

use flate2::read::GzDecoder;
use papilla_proto::{FrameHeader, FrameStatus, flags};
use tokio_tungstenite::tungstenite::Message;

use crate::support::Service;

/// Members of texts that are of the run: a count of sessions, times, words for people.
const OF_THE_RUN: [&str; 4] = ["session", "predicted_latency_us", "meets_budget", "message"];

/// Version 2 clamps and flags pressure out of range where the hello does not say; it refused it then.
const CHANGED: [&str; 1] = ["2 out of range by default"];

/// Whether a session of the recording has the effect `afferents`.
fn has_rates(session: &str) -> bool {
    session.contains("afferents") || session.contains("everything")
}

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/recorded"))
}

fn recording() -> String {
    let packed = fs::read(folder().join("versions-1-2.txt.gz")).unwrap();
    let mut text = String::new();
    GzDecoder::new(&packed[..]).read_to_string(&mut text).unwrap();
    text
}

/// A message as the recording writes it: `text WORDS`, or `binary BYTES HEX` without zeros at the end.
fn message(written: &str) -> Message {
    let (kind, rest) = written.split_once(' ').unwrap();
    if kind == "text" {
        return Message::text(rest);
    }
    let (length, hex) = rest.split_once(' ').unwrap();
    let byte = |i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap();
    let mut bytes: Vec<u8> = (0..hex.len()).step_by(2).map(byte).collect();
    bytes.resize(length.parse().unwrap(), 0);
    Message::binary(bytes)
}

/// What of a message is the protocol's: its bytes, and the map where it counts units of a scale.
fn lasting(message: Message) -> (Vec<u8>, Vec<f32>, f32) {
    if let Message::Text(words) = message {
        let words = OF_THE_RUN.iter().fold(words.to_string(), |words, name| blank(&words, name));
        return (words.into_bytes(), vec![], 0.0);
    }
    let mut bytes = message.into_data().to_vec();
    let header = FrameHeader::decode(&bytes).unwrap();
    bytes[24..28].fill(0);
    if bytes[4] == 2 {
        bytes[36..44].fill(0);
        bytes[46] &= !flags::CUT_OFF;
    }
    if !header.sample_type.is_scaled() || header.status != FrameStatus::Ok {
        return (bytes, vec![], 0.0);
    }
    let mut map = vec![0.0; header.window().pixel_count()];
    let samples = bytes.split_off(bytes.len() - map.len() * header.sample_type.bytes());
    header.sample_type.decode(&samples, header.scale, &mut map).unwrap();
    bytes[28..32].fill(0);
    (bytes, map, header.scale)
}

/// Whether two messages are the same, maps of units to half a unit of each.
fn are_same(found: Message, due: Message) -> bool {
    let (found, due) = (lasting(found), lasting(due));
    let error = 0.5001 * (found.2 + due.2);
    let near = |(f, d): (&f32, &f32)| (f - d).abs() <= error;
    found.0 == due.0 && found.1.len() == due.1.len() && found.1.iter().zip(&due.1).all(near)
}

/// The text without the value of a member: a number, a truth value or a string without quotes in it.
fn blank(text: &str, member: &str) -> String {
    let Some((before, rest)) = text.split_once(&format!("\"{member}\":")) else {
        return text.to_owned();
    };
    let end = match rest.strip_prefix('"') {
        Some(string) => string.replace("\\\"", "__").find('"').unwrap() + 2,
        None => rest.find([',', '}']).unwrap(),
    };
    format!("{before}\"{member}\":_{}", &rest[end..])
}

#[tokio::test(flavor = "multi_thread")]
async fn versions_1_and_2_answer_what_they_answered_before_version_3() {
    let models = folder().join("models");
    let service = Service::start_with(|config| config.models = Some(models)).await;
    let (mut socket, mut session, recording) = (service.socket().await, String::new(), recording());
    let (mut compared, mut changed, mut others) = (0, vec![], vec![]);
    for line in recording.lines() {
        match line.split_once(' ').unwrap() {
            ("session", name) => {
                socket = service.socket().await;
                session = name.to_owned();
            }
            (">", said) => socket.send(message(said)).await,
            (_, due) => {
                let (found, due) = (socket.hear().await, message(due));
                if has_rates(&session) {
                    continue;
                }
                compared += 1;
                if !are_same(found.clone(), due.clone()) {
                    let differing =
                        if CHANGED.contains(&&*session) { &mut changed } else { &mut others };
                    differing.push(format!(
                        "{session}:\n  {}\n  {} is due",
                        shown(&found),
                        shown(&due)
                    ));
                }
            }
        }
    }
    assert!(others.is_empty(), "{} answers differ:\n{}", others.len(), others.join("\n"));
    assert_eq!(changed.len(), CHANGED.len(), "what is said to have changed has: {changed:?}");
    assert!(compared > 150, "{compared} answers");
}

/// A message for people.
fn shown(message: &Message) -> String {
    let Message::Binary(bytes) = message else { return message.to_string() };
    format!("{:02x?} of {} bytes", &bytes[..bytes.len().min(64)], bytes.len())
}
