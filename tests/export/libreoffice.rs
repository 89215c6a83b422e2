//! LibreOffice as the reader of what was exported.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Converts a file as `soffice --convert-to` does, reading it with `infilter`, into `out`; `None` where LibreOffice is not
/// installed, which is said.
pub fn convert(file: &Path, infilter: Option<&str>, to: &str, out: &Path) -> Option<PathBuf> {
    let profile = out.join("profile");
    let mut command = Command::new("soffice");
    command.arg(format!("-env:UserInstallation=file://{}", profile.display())).arg("--headless");
    if let Some(filter) = infilter {
        command.arg(format!("--infilter={filter}"));
    }
    command.args(["--convert-to", to, "--outdir"]).args([out, file]);
    match command.output() {
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) => {
            eprintln!("skipped: LibreOffice cannot be started here ({error})");
            return None;
        }
    }
    Some(out.to_path_buf())
}

/// The options that read a CSV file in UTF-8 with that separator, in the language of that number, taking as a number or
/// date whatever may be one.
pub fn reading(separator: u8, language: u32) -> String {
    format!("Text - txt - csv (StarCalc):{separator},34,76,1,,{language},false,true")
}

/// The options that write every sheet as a CSV file with all digits.
pub const WRITING: &str = "csv:Text - txt - csv (StarCalc):44,34,76,1,,0,false,true,false,false,false,-1";
