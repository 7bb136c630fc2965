use std::{ffi::OsString, fs};

use clap::CommandFactory;

use super::*;

fn read(args: &[&str]) -> Result<(Config, String), String> {
    let args = std::iter::once("papilla-server").chain(args.iter().copied());
    match Cli::read_and_print(args.map(OsString::from)) {
        Ok((cli, text)) => Ok((cli.settings, text)),
        Err(error) => Err(error.to_string()),
    }
}

/// A file of settings; dropped, it is deleted.
fn file(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("papilla.toml");
    fs::write(&path, text).unwrap();
    let path = path.to_str().unwrap().to_owned();
    (folder, path)
}

#[test]
fn defaults_and_command_line_agree() {
    let (parsed, _) = read(&[]).unwrap();
    let expected = Config { bind: parsed.bind, ..Config::default() };
    assert_eq!(format!("{parsed:?}"), format!("{expected:?}"));
    assert_eq!(parsed.bind.to_string(), "127.0.0.1:7224");
}

#[test]
fn the_command_line_is_sound() {
    Cli::command().debug_assert();
    for bad in [["--threads", "0"], ["--bind", "nowhere"], ["--max-sessions", "many"]] {
        assert!(read(&bad).unwrap_err().contains(bad[0]), "{bad:?}");
    }
    assert!(read(&["--thread", "1"]).is_err());
}

/// One figure of a finger's memory: `--help` and the pages name what the crate's test holds.
#[test]
fn help_and_pages_say_what_a_finger_takes() {
    let help = Cli::command().render_long_help().to_string();
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let figure = format!("{} MiB", papilla_session_contact::FINGER_BYTES_MAX >> 20);
    assert!(help.contains(&format!("of up to {figure} each")), "{help}");
    for (page, line) in [
        (
            "docs/reference/settings.md",
            format!("fingers of all sessions together, up to {figure} each"),
        ),
        ("docs/guides/operating.md", format!("| a finger | {figure} ")),
    ] {
        let path = format!("{}/../{page}", env!("CARGO_MANIFEST_DIR"));
        assert!(fs::read_to_string(path).unwrap().contains(&line), "{page}: {line}");
    }
}

#[test]
fn every_setting_has_its_variable() {
    for arg in file::settings() {
        let due = format!("PAPILLA_{}", arg.get_id().as_str().to_ascii_uppercase());
        let found = arg.get_env().and_then(|name| name.to_str());
        assert_eq!(found, Some(due.as_str()));
    }
}

#[test]
fn the_command_line_wins_over_the_file_and_the_file_over_the_default() {
    let (_folder, path) = file(
        "bind = \"127.0.0.1:9\"\nthreads = 3\nmax_sessions = 5\nallow_origin = \
         [\"https://a.example\", \"https://b.example\"]\njson = true\nwatch_models = false",
    );
    let (settings, text) = read(&["--config", &path, "--threads", "2"]).unwrap();
    assert_eq!(settings.bind.port(), 9);
    assert_eq!(settings.threads, NonZeroUsize::new(2));
    assert_eq!(settings.max_sessions.get(), 5);
    assert_eq!(settings.max_requests.get(), 64);
    assert_eq!(settings.allow_origin, ["https://a.example", "https://b.example"]);
    assert!(settings.json && !settings.watch_models);
    for line in [
        "threads = 2 # command line",
        "max_sessions = 5 # file",
        "max_requests = 64 # default",
        "# tokens is not set",
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
    // Whether a flag stands before or after the subcommand does not matter.
    for args in [["--threads", "7", "check"], ["check", "--threads", "7"]] {
        let args = std::iter::once("papilla-server").chain(args).map(OsString::from);
        let cli = Cli::read(args).unwrap();
        assert_eq!(cli.settings.threads, NonZeroUsize::new(7));
        assert_eq!(cli.command, Some(Command::Check));
    }
}

#[test]
fn what_is_printed_reads_back() {
    let args = ["--max-body-bytes", "300000", "--allow-origin", "https://a.example", "--json"];
    let (settings, text) = read(&args).unwrap();
    let (_folder, path) = file(&text);
    let (again, _) = read(&["--config", &path]).unwrap();
    assert_eq!(format!("{settings:?}"), format!("{again:?}"));
}

#[test]
fn a_file_with_a_byte_order_mark_is_read_and_utf_16_is_named() {
    let (_folder, path) = file("\u{feff}threads = 3\n");
    assert_eq!(read(&["--config", &path]).unwrap().0.threads, NonZeroUsize::new(3));
    let wide: Vec<u8> = "threads = 3\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(&path, wide).unwrap();
    assert!(read(&["--config", &path]).unwrap_err().contains("UTF-16"));
}

#[test]
fn a_bad_file_is_refused_by_field() {
    for (text, words) in [
        ("max_session = 5", ["'max_session'", "max_sessions"]),
        ("threads = 0", ["threads", "'0'"]),
        ("threads = -1", ["threads", "'-1'"]),
        ("threads = [1, 2]", ["threads", "array"]),
        ("json = \"yes\"", ["json", "true or false"]),
        ("bind = \"here\"", ["bind", "'here'"]),
        ("bind = ", ["not TOML", "line 1"]),
        ("config = \"other.toml\"", ["'config'", "no setting"]),
        ("[limits]\nthreads = 1", ["'limits'", "no setting"]),
    ] {
        let (_folder, path) = file(text);
        let error = read(&["--config", &path]).unwrap_err();
        for word in words {
            assert!(error.contains(word), "{word} is not in: {error}");
        }
        // A value that a flag overrides is still looked at.
        assert!(read(&["--config", &path, "--threads", "4", "--bind", "[::1]:1"]).is_err());
    }
    assert!(read(&["--config", "/no/such/file"]).unwrap_err().contains("/no/such/file"));
}

#[test]
fn settings_at_odds_are_refused_by_field() {
    let refused = |change: fn(&mut Config)| {
        let mut settings = Config::default();
        settings.validate().unwrap();
        change(&mut settings);
        settings.validate().unwrap_err().field
    };
    let public = |s: &mut Config| s.bind = SocketAddr::from(([0, 0, 0, 0], 80));
    assert_eq!(refused(public), "bind");
    assert_eq!(refused(|s| s.tls_cert = Some("c.pem".into())), "tls_key");
    assert_eq!(refused(|s| s.tls_key = Some("k.pem".into())), "tls_cert");
    assert_eq!(refused(|s| s.watch_models = true), "watch_models");
    assert_eq!(refused(|s| s.xr_dir = Some("/no/such/folder".into())), "xr_dir");
    assert_eq!(refused(|s| s.max_body_bytes = 1000), "max_body_bytes");
    #[cfg(not(feature = "ort"))]
    assert_eq!(refused(|s| s.backend = Choice::Only(papilla_engine::Backend::Ort)), "backend");
    for origin in ["lab.example", "https://", "https://a/b", "ftp://a", "*"] {
        let settings = Config { allow_origin: vec![origin.into()], ..Config::default() };
        assert_eq!(settings.validate().unwrap_err().field, "allow_origin", "{origin}");
    }
    let open = Config { allow_anyone: true, bind: ([0, 0, 0, 0], 80).into(), ..Config::default() };
    open.validate().unwrap();
}

/// Each layer refuses a number beyond its range, and says the range.
#[test]
fn numbers_beyond_their_range_are_refused_with_it() {
    let huge = u64::MAX.to_string();
    for (field, bad, range) in [
        ("max_sessions", huge.as_str(), "1 to 10000"),
        ("max_sessions", "1000000000000", "1 to 10000"),
        ("max_requests", &huge, "1 to 10000"),
        ("max_requests", "99999999999999999999", "1 to 10000"),
        ("max_connections", &huge, "1 to 100000"),
        ("threads", &huge, "1 to 1024"),
        ("rate_per_s", "4000000000", "0 to 1000000"),
        ("rate_burst", "4000000000", "1 to 1000000"),
        ("io_timeout_s", "9223372036854775807", "1 to 86400"),
        ("io_timeout_s", "0", "1 to 86400"),
        ("idle_timeout_s", &huge, "1 to 86400"),
        ("drain_timeout_s", &huge, "0 to 86400"),
        ("calibration_ms", &huge, "0 to 600000"),
    ] {
        let flag = format!("--{}", field.replace('_', "-"));
        let error = read(&[&flag, bad]).unwrap_err();
        assert!(error.contains(&flag) && error.contains(range), "{field}: {error}");
        if bad.parse::<i64>().is_ok() {
            let (_folder, path) = file(&format!("{field} = {bad}"));
            let error = read(&["--config", &path]).unwrap_err();
            assert!(error.contains(field) && error.contains(range), "{field}: {error}");
        }
    }
    // A program that starts the service itself reads no layer.
    let n = |n| NonZeroUsize::new(n).unwrap();
    for (field, change) in [
        ("max_sessions", (|s| s.max_sessions = NonZeroUsize::MAX) as fn(&mut Config)),
        ("max_connections", |s| s.max_connections = NonZeroUsize::MAX),
        ("io_timeout_s", |s| s.io_timeout_s = u64::MAX),
        ("io_timeout_s", |s| s.io_timeout_s = 0),
    ] {
        let mut settings = Config { max_sessions: n(10_000), ..Config::default() };
        settings.validate().unwrap();
        change(&mut settings);
        assert_eq!(settings.validate().unwrap_err().field, field);
    }
}
