//! Both halves against the library's server.

use std::{net::TcpListener, thread};

use papilla_proto::{ErrorCode, FrameStatus, HEADER_LEN, Problem, SampleType};
use tokio_tungstenite::tungstenite::{
    Message, WebSocket,
    protocol::{Role, WebSocketConfig},
};

use super::*;

/// Both halves, and a server of the library's at the other end.
fn pair() -> (Mouth, Hearer, WebSocket<TcpStream>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (far, _) = listener.accept().unwrap();
    let config = WebSocketConfig::default();
    let (mouth, hearer) = halves(near).unwrap();
    (mouth, hearer, WebSocket::from_raw_socket(far, Role::Server, Some(config)))
}

fn soon() -> Instant {
    Instant::now() + Duration::from_secs(60)
}

#[test]
fn a_library_understands_what_is_sent() {
    let (mut mouth, _hearer, mut server) = pair();
    let lens = [0, 1, 5, 77, 78, 79, 65_000, 200_704];
    let sending = thread::spawn(move || {
        for len in lens {
            let header = FrameHeader::pressure(len as u32, 7, 0, SampleType::U8, 1.0);
            let payload: Vec<u8> = (0..len).map(|i| i as u8).collect();
            mouth.send(&header, &payload).unwrap();
        }
        mouth.close();
    });
    for len in lens {
        let Message::Binary(frame) = server.read().unwrap() else { panic!("no frame") };
        let header = FrameHeader::decode(&frame).unwrap();
        assert_eq!((header.sequence, frame.len()), (len as u32, HEADER_LEN + len));
        let samples = &frame[HEADER_LEN..];
        assert!(samples.iter().enumerate().all(|(i, &byte)| byte == i as u8), "{len}");
    }
    assert!(matches!(server.read().unwrap(), Message::Close(Some(_))));
    sending.join().unwrap();
}

#[test]
fn what_a_library_sends_is_understood() {
    let (_mouth, mut hearer, mut server) = pair();
    let answering = thread::spawn(move || {
        server.send(Message::Ping("there?".into())).unwrap();
        for n in 0..50_u32 {
            let header = FrameHeader::pressure(n, 0, 0, SampleType::F32, 1.0);
            let mut frame = header.answer(FrameStatus::Ok, n, 1.0).encode().to_vec();
            frame.resize(frame.len() + 4096 * n as usize, n as u8);
            server.send(Message::binary(frame)).unwrap();
        }
        let error = SessionError::new(Problem::new(ErrorCode::Overloaded, "full"), None, true);
        let text = serde_json::to_string(&ServerMessage::Error(error)).unwrap();
        server.send(Message::text(text)).unwrap();
        assert_eq!(server.read().unwrap(), Message::Pong("there?".into()));
        server.close(None).unwrap();
    });
    for n in 0..50_u32 {
        let Some((_, Said::Frame(header, samples))) = hearer.receive(soon()).unwrap() else {
            panic!("no frame {n}")
        };
        assert_eq!((header.sequence, samples.len()), (n, 4096 * n as usize));
        assert!(samples.iter().all(|&byte| byte == n as u8));
    }
    let Some((_, Said::Error(error))) = hearer.receive(soon()).unwrap() else { panic!("no error") };
    assert_eq!(error.code, ErrorCode::Overloaded);
    assert!(matches!(hearer.receive(soon()), Err(SocketError::Closed)));
    answering.join().unwrap();
}

#[test]
fn silence_ends() {
    let (_mouth, mut hearer, _server) = pair();
    assert!(hearer.receive(Instant::now()).unwrap().is_none());
}
