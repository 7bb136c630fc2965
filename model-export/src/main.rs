//! `model-export`: checks, evaluates and describes exported Papilla models.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = cli::Arguments::parse();
    match cli::run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error
                .downcast_ref::<papilla_model_export::ExportError>()
                .map_or(1, papilla_model_export::ExportError::exit_code);
            let said = papilla_output::told(error.as_ref());
            if arguments.json {
                let report = serde_json::json!({"error": {"message": said, "exit_code": code}});
                println!("{report}");
            } else {
                eprintln!("error: {said}");
            }
            ExitCode::from(code)
        }
    }
}
