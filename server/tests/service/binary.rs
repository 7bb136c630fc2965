//! The program itself: start line, signals, exit codes.

use std::{
    io::{BufRead, BufReader, Read},
    path::Path,
    process::{Child, Command, Stdio},
};

use serde_json::Value;

use crate::support::{Request, bytes_of, model_folder, ramp};

fn program(models: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_papilla-server"));
    command.arg("--models").arg(models).args(["--bind", "127.0.0.1:0", "--threads", "1"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
}

#[tokio::test(flavor = "multi_thread")]
async fn it_says_where_it_is_and_ends_on_either_signal() {
    let models = model_folder();
    for name in ["TERM", "INT"] {
        let mut child = program(models.path()).arg("--json").spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let start: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(
            (&start["event"], &start["default_tier"]),
            (&"listening".into(), &"quick".into())
        );
        assert_eq!(start["threads"], 1);
        let address = start["address"].as_str().unwrap().trim_start_matches("http://");
        let request =
            Request::new(address.parse().unwrap(), "POST", "/v1/sed").body(bytes_of(&ramp()));
        assert_eq!(request.send().await.status, 200);
        signal(&child, name);
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(0), "{name}");
    }
}

#[test]
fn exit_codes_are_the_documented_ones() {
    let models = model_folder();
    let empty = tempfile::tempdir().unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap().to_string();
    for (folder, arguments, code, word) in [
        (empty.path(), vec![], 3, "index.json"),
        (models.path(), vec!["--default-tier", "best"], 3, "quick, slow"),
        (models.path(), vec!["--bind", &taken], 4, "--bind"),
        // Said before any model is looked for.
        (empty.path(), vec!["--bind", &taken], 4, "--bind"),
        (models.path(), vec!["--threads", "none"], 2, "--threads"),
        (models.path(), vec!["--log", "=="], 2, "log"),
    ] {
        let mut command = program(folder);
        // The later --bind would be a repetition.
        if arguments.first() == Some(&"--bind") {
            command = Command::new(env!("CARGO_BIN_EXE_papilla-server"));
            command.arg("--models").arg(folder).stderr(Stdio::piped());
        }
        let mut child = command.args(&arguments).spawn().unwrap();
        let mut words = String::new();
        child.stderr.take().unwrap().read_to_string(&mut words).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(code), "{arguments:?}: {words}");
        assert!(words.contains(word), "{words}");
    }
}

#[test]
fn the_help_teaches() {
    let help = Command::new(env!("CARGO_BIN_EXE_papilla-server")).arg("--help").output().unwrap();
    let text = String::from_utf8(help.stdout).unwrap();
    for word in ["PAPILLA_BIND", "127.0.0.1:7224", "Examples:", "Exit codes:", "curl"] {
        assert!(text.contains(word), "{word} is missing from\n{text}");
    }
}
