//! The file of bearer tokens, and who holds which.

use std::{fs, num::NonZeroUsize, path::Path, sync::Arc};

use papilla_proto::json;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use subtle::{Choice, ConditionallySelectable, ConstantTimeEq};
use tokio::sync::Semaphore;

/// Shortest token taken from a file, bytes; shorter ones can be guessed.
const TOKEN_MIN: usize = 16;

/// The members of a `[[token]]`.
const MEMBERS: [&str; 5] = ["name", "token", "sha256", "max_sessions", "admin"];

/// The file: a list of `[[token]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    token: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    /// For messages and rates.
    name: String,
    /// The token itself,
    token: Option<String>,
    /// or its SHA-256, 64 hexadecimal digits, so that the file gives nothing away.
    sha256: Option<String>,
    /// Greatest number of its sessions that are open at once.
    max_sessions: Option<NonZeroUsize>,
    /// Whether it may reload the models.
    #[serde(default)]
    admin: bool,
}

/// The holder of a token.
#[derive(Debug)]
pub(crate) struct Holder {
    pub(crate) name: Arc<str>,
    digest: [u8; 32],
    /// Its places for sessions; none: as many as the service has.
    pub(crate) sessions: Option<Arc<Semaphore>>,
    pub(crate) is_admin: bool,
}

/// All tokens.
#[derive(Debug)]
pub(crate) struct Tokens(Vec<Arc<Holder>>);

impl Tokens {
    /// Reads the file.
    ///
    /// # Errors
    /// Which entry is wrong, and how.
    pub(crate) fn read(path: &Path) -> Result<Self, String> {
        let text = json::read_text(path).map_err(|e| format!("{}: {e}", path.display()))?;
        warn_if_readable(path);
        Self::parse(&text).map_err(|reason| format!("{}: {reason}", path.display()))
    }

    fn parse(text: &str) -> Result<Self, String> {
        let file: File = toml::from_str(text).map_err(|error| reason(text, &error))?;
        let mut holders: Vec<Arc<Holder>> = Vec::with_capacity(file.token.len());
        for entry in file.token {
            let name = entry.name.clone();
            let holder = holder(entry).map_err(|reason| format!("token '{name}': {reason}"))?;
            if holders.iter().any(|h| h.name == holder.name || h.digest == holder.digest) {
                return Err(format!("token '{name}': its name or token is listed twice"));
            }
            holders.push(Arc::new(holder));
        }
        if holders.is_empty() {
            return Err("there is no [[token]]; nobody could use the service".to_owned());
        }
        Ok(Self(holders))
    }

    /// Number of tokens.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Who holds the token, in a time that tells nothing of how nearly it was right: digests
    /// are compared, all of them, each to its end.
    pub(crate) fn holder(&self, shown: &str) -> Option<Arc<Holder>> {
        let shown: [u8; 32] = Sha256::digest(shown.as_bytes()).into();
        let mut found = u64::MAX;
        for (index, holder) in self.0.iter().enumerate() {
            let same: Choice = holder.digest.ct_eq(&shown);
            found.conditional_assign(&(index as u64), same);
        }
        self.0.get(usize::try_from(found).ok()?).map(Arc::clone)
    }
}

/// What is wrong and in which line, without what the line says: it may be a token. Of what the
/// parser quotes stay the words that are too short for one.
fn reason(text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    let line = 1 + before.matches('\n').count();
    let member = text.lines().nth(line - 1).and_then(|line| line.split_once('='));
    let member = member.map(|(member, _)| member.trim()).filter(|member| MEMBERS.contains(member));
    let of_member = member.map(|member| format!(", {member}")).unwrap_or_default();
    // Texts come in double quotes, and may hold quotes themselves: nothing behind the first stays.
    let message = error.message();
    let (message, is_cut) = match message.split_once('"') {
        Some((message, _)) => (message, true),
        None => (message, false),
    };
    let parts = message.split('`').enumerate().map(|(place, part)| {
        // Every second part stands between backticks.
        if place % 2 == 1 && part.len() >= TOKEN_MIN { "…" } else { part }
    });
    let message = parts.collect::<Vec<_>>().join("`");
    format!("line {line}{of_member}: {}{}", message.trim_end(), if is_cut { " …" } else { "" })
}

fn holder(entry: Entry) -> Result<Holder, String> {
    if entry.name.is_empty() {
        return Err("it has no name".to_owned());
    }
    let digest = match (&entry.token, &entry.sha256) {
        (Some(token), None) => {
            // As files end: `token = """` and a pasted line.
            let token = token.trim();
            // RFC 6750 2.1.
            let is_token = |b: u8| b.is_ascii_alphanumeric() || b"-._~+/=".contains(&b);
            if token.len() < TOKEN_MIN || !token.bytes().all(is_token) {
                return Err(format!(
                    "{TOKEN_MIN} or more of A-Z, a-z, 0-9, - . _ ~ + / = are due; try \
                     `openssl rand -hex 32`"
                ));
            }
            Sha256::digest(token.as_bytes()).into()
        }
        (None, Some(hex)) => from_hex(hex).ok_or("sha256 has not 64 hexadecimal digits")?,
        _ => return Err("one of 'token' and 'sha256' is due".to_owned()),
    };
    let places = |n: NonZeroUsize| Arc::new(Semaphore::new(n.get().min(Semaphore::MAX_PERMITS)));
    Ok(Holder {
        name: entry.name.into(),
        digest,
        sessions: entry.max_sessions.map(places),
        is_admin: entry.admin,
    })
}

fn from_hex(text: &str) -> Option<[u8; 32]> {
    let mut digest = [0; 32];
    if text.len() != 64 || !text.is_ascii() {
        return None;
    }
    for (byte, pair) in digest.iter_mut().zip(text.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
    }
    Some(digest)
}

#[cfg(unix)]
fn warn_if_readable(path: &Path) {
    use std::os::unix::fs::PermissionsExt;
    if fs::metadata(path).is_ok_and(|data| data.permissions().mode() & 0o077 != 0) {
        tracing::warn!(path = %path.display(), "other users may read the tokens; chmod 600");
    }
}

#[cfg(not(unix))]
fn warn_if_readable(_: &Path) {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::digest::sha256_hex;

    const A: &str = "0123456789abcdef";

    #[test]
    fn holders_are_found_by_token_and_by_nothing_else() {
        let hidden = "fedcba9876543210";
        let text = format!(
            "[[token]]\nname = \"a\"\ntoken = \"{A}\"\nmax_sessions = 2\n[[token]]\nname = \
             \"b\"\nsha256 = \"{}\"\nadmin = true",
            sha256_hex(hidden.as_bytes())
        );
        let tokens = Tokens::parse(&text).unwrap();
        let a = tokens.holder(A).unwrap();
        assert_eq!((&*a.name, a.is_admin), ("a", false));
        assert_eq!(a.sessions.as_ref().unwrap().available_permits(), 2);
        let b = tokens.holder(hidden).unwrap();
        assert_eq!((&*b.name, b.is_admin, b.sessions.is_none()), ("b", true, true));
        for wrong in ["", "0123456789abcdeF", "0123456789abcde", "0123456789abcdef0"] {
            assert!(tokens.holder(wrong).is_none(), "{wrong}");
        }
    }

    /// What is wrong is said without the line it is in.
    #[test]
    fn no_error_tells_a_token() {
        let secret = "s3cret-0123456789abcdef";
        for text in [
            format!("[[token]]\nname = \"a\"\ntoken = \"{secret}\nadmin = true"),
            format!("[[token]]\nname = \"a\"\ntoken = {secret}"),
            format!("token = \"{secret}\""),
            format!("token = [\"{secret}\"]"),
            format!("[[token]]\nname = \"a\"\n{secret} = true"),
            format!("[[token]]\nname = \"a\"\nadmin = \"{secret}\""),
            format!("[[token]]\nname = \"a\"\nmax_sessions = \"x\\\"{secret}\""),
            format!("[[token]]\nname = \"a\"\ntoken = \"{secret}\"\ntoken = \"{secret}\""),
            format!("\"{secret}\""),
            "[[token]]\nname = \"a\"\ntoken = 1234567890123456789".to_owned(),
        ] {
            let error = Tokens::parse(&text).unwrap_err();
            assert!(error.contains("line "), "{error}");
            let tells = error.contains("s3cret") || error.contains("0123456789");
            assert!(!tells && !error.contains("1234567"), "{error}");
        }
    }

    #[test]
    fn a_bad_file_is_refused_by_entry() {
        let entry = |members: &str| format!("[[token]]\nname = \"a\"\n{members}");
        let twice = format!("{0}\n{0}", entry(&format!("token = \"{A}\"")));
        for (text, word) in [
            ("token = []".to_owned(), "no [[token]]"),
            (String::new(), "missing field `token`"),
            (entry(""), "one of"),
            (entry(&format!("token = \"{A}\"\nsha256 = \"x\"")), "one of"),
            (entry("token = \"short\""), "16 or more"),
            (entry("token = \"0123456789 abcdef\""), "16 or more"),
            (entry("sha256 = \"12\""), "64"),
            (entry("tokn = \"x\""), "tokn"),
            (entry(&format!("token = \"{A}\"\nmax_sessions = 0")), "max_sessions"),
            (twice, "twice"),
        ] {
            let error = Tokens::parse(&text).unwrap_err();
            assert!(error.contains(word), "{word} is not in: {error}");
        }
    }
}
