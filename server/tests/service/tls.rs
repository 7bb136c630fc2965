//! The service behind its own certificate.

use std::sync::Arc;

use papilla_proto::{FrameStatus, SampleType};
use serde_json::json;
use tempfile::TempDir;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};
use tokio_rustls::{
    TlsConnector,
    client::TlsStream,
    rustls::{ClientConfig, RootCertStore, crypto::ring, pki_types::CertificateDer},
};

use crate::support::{Answer, Service, Socket, bytes_of, frame, hello, model_folder, ramp, write};

/// A service with a fresh certificate for `localhost`, and who trusts it.
async fn secured() -> (Service, TlsConnector, TempDir) {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "cert.pem", made.cert.pem().as_bytes());
    write(folder.path(), "key.pem", made.signing_key.serialize_pem().as_bytes());
    let [cert, key] = ["cert.pem", "key.pem"].map(|name| folder.path().join(name));
    let service = Service::start_with(|config| {
        (config.tls_cert, config.tls_key) = (Some(cert), Some(key));
        config.io_timeout_s = 1;
    })
    .await;
    (service, trusting(made.cert.der().clone()), folder)
}

fn trusting(certificate: CertificateDer<'static>) -> TlsConnector {
    let mut roots = RootCertStore::empty();
    roots.add(certificate).unwrap();
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots)
        .with_no_client_auth();
    TlsConnector::from(Arc::new(config))
}

async fn connect(service: &Service, tls: &TlsConnector) -> std::io::Result<TlsStream<TcpStream>> {
    let stream = TcpStream::connect(service.address).await?;
    tls.connect("localhost".try_into().unwrap(), stream).await
}

#[tokio::test(flavor = "multi_thread")]
async fn maps_and_sessions_go_over_tls() {
    let (service, tls, _files) = secured().await;
    let mut stream = connect(&service, &tls).await.unwrap();
    let body = bytes_of(&ramp());
    let head = format!(
        "POST /v1/sed HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-length: \
         {}\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes()).await.unwrap();
    stream.write_all(&body).await.unwrap();
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer).await;
    assert_eq!(Answer::parse(&answer).status, 200);

    let mut socket = Socket::over(connect(&service, &tls).await.unwrap()).await;
    socket.open(hello(&json!({}))).await;
    socket.send(frame(1, 0, SampleType::F32, 1.0, &ramp())).await;
    assert_eq!(socket.hear_frame().await.0.status, FrameStatus::Ok);
    let drain = tokio::spawn(service.server.drain());
    socket.hear_end("shutting_down", 1001).await;
    drain.await.unwrap().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn plain_text_and_silence_are_not_served() {
    let (service, tls, _files) = secured().await;
    let bytes = crate::support::raw_exchange(service.address, b"GET / HTTP/1.1\r\n\r\n").await;
    assert!(!bytes.starts_with(b"HTTP"), "{}", String::from_utf8_lossy(&bytes));
    // A client that never says hello is dropped, and others are served meanwhile.
    let mut silent = TcpStream::connect(service.address).await.unwrap();
    assert!(connect(&service, &tls).await.is_ok());
    let mut rest = Vec::new();
    let _ = silent.read_to_end(&mut rest).await;
    assert!(rest.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_certificate_is_named() {
    let (_service, _, files) = secured().await;
    let other = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    write(files.path(), "other.pem", other.signing_key.serialize_pem().as_bytes());
    write(files.path(), "empty.pem", b"");
    for (cert, key, field) in [
        ("cert.pem", "other.pem", "tls_key"),
        ("empty.pem", "key.pem", "tls_cert"),
        ("cert.pem", "empty.pem", "tls_key"),
        ("none.pem", "key.pem", "tls_cert"),
    ] {
        let result = Service::on(model_folder(), |config| {
            config.tls_cert = Some(files.path().join(cert));
            config.tls_key = Some(files.path().join(key));
        });
        let error = result.await.err().unwrap().to_string();
        assert!(error.starts_with(field), "{cert} {key}: {error}");
    }
}
