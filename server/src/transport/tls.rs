//! TLS with the operator's own certificate.

use std::{path::Path, sync::Arc};

use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        ServerConfig,
        crypto::ring,
        pki_types::{
            CertificateDer, PrivateKeyDer,
            pem::{self, PemObject},
        },
    },
};

use crate::config::{Config, SettingError};

/// The acceptor of the configured certificate; None without one.
///
/// # Errors
/// A file cannot be read, or the key is not the certificate's.
pub(crate) fn acceptor(config: &Config) -> Result<Option<TlsAcceptor>, SettingError> {
    let (Some(cert), Some(key)) = (&config.tls_cert, &config.tls_key) else { return Ok(None) };
    let bad = |field, path: &Path, error: &dyn std::fmt::Display| SettingError {
        field,
        reason: format!("{}: {error}", path.display()),
    };
    let chain: Vec<_> = CertificateDer::pem_file_iter(cert)
        .and_then(Iterator::collect)
        .map_err(|error| bad("tls_cert", cert, &in_words(error)))?;
    if chain.is_empty() {
        return Err(bad("tls_cert", cert, &"there is no certificate in it"));
    }
    let secret =
        PrivateKeyDer::from_pem_file(key).map_err(|error| bad("tls_key", key, &in_words(error)))?;
    let mut server = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(|error| bad("tls_cert", cert, &error))?
        .with_no_client_auth()
        .with_single_cert(chain, secret)
        .map_err(|error| bad("tls_key", key, &error))?;
    // WebSockets go over HTTP/1.1, so nothing else is offered.
    server.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Some(TlsAcceptor::from(Arc::new(server))))
}

/// What is wrong with a PEM file, without its bytes: those of a key are secret.
fn in_words(error: pem::Error) -> String {
    match error {
        pem::Error::MissingSectionEnd { .. } => {
            "it is cut short: a section has no END line".to_owned()
        }
        pem::Error::IllegalSectionStart { .. } => {
            "a BEGIN line does not end in five hyphens".to_owned()
        }
        pem::Error::Base64Decode(_) => "a section is not base64".to_owned(),
        pem::Error::Io(error) => error.to_string(),
        pem::Error::NoItemsFound => "there is nothing in it that could be used here".to_owned(),
        _ => "it is not PEM".to_owned(),
    }
}
