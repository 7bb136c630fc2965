//! The protocol, held against what an earlier build said.
//!
//! `server/tests/recorded/record` has made the recording; the models beside it multiply, so that
//! their answers are the same bits on every processor. Not compared, since they are of the run and
//! not of the protocol: in answers the times (bytes 24 to 27 and 36 to 43), in texts
//! [`OF_THE_RUN`].

use std::{fs, io::Read, path::Path};

use flate2::read::GzDecoder;
use tokio_tungstenite::tungstenite::Message;

use crate::support::Service;

/// Members of texts that are of the run: a count of sessions, times, words for people.
const OF_THE_RUN: [&str; 4] = ["session", "predicted_latency_us", "meets_budget", "message"];

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/recorded"))
}

fn recording() -> String {
    let packed = fs::read(folder().join("sessions.txt.gz")).unwrap();
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

/// What of a message is the protocol's.
fn lasting(message: Message) -> Vec<u8> {
    if let Message::Text(words) = message {
        let words = OF_THE_RUN.iter().fold(words.to_string(), |words, name| blank(&words, name));
        return words.into_bytes();
    }
    let mut bytes = message.into_data().to_vec();
    bytes[24..28].fill(0);
    bytes[36..44].fill(0);
    bytes
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
async fn sessions_are_answered_as_they_were_before() {
    let models = folder().join("models");
    let service = Service::start_with(|config| config.models = Some(models)).await;
    let (mut socket, mut session, recording) = (service.socket().await, "", recording());
    let (mut compared, mut differing) = (0, vec![]);
    for line in recording.lines() {
        match line.split_once(' ').unwrap() {
            ("session", name) => {
                socket = service.socket().await;
                session = name;
            }
            (">", said) => socket.send(message(said)).await,
            (_, due) => {
                let (found, due) = (socket.hear().await, message(due));
                compared += 1;
                if lasting(found.clone()) != lasting(due.clone()) {
                    let (found, due) = (shown(&found), shown(&due));
                    differing.push(format!("{session}:\n  {found}\n  {due} is due"));
                }
            }
        }
    }
    assert!(differing.is_empty(), "{} answers differ:\n{}", differing.len(), differing.join("\n"));
    assert!(compared > 150, "{compared} answers");
}

/// A message for people.
fn shown(message: &Message) -> String {
    let Message::Binary(bytes) = message else { return message.to_string() };
    format!("{:02x?} of {} bytes", &bytes[..bytes.len().min(64)], bytes.len())
}
