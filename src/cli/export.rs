use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{ArgGroup, Args};

use crate::base::files::write_whole;
use crate::base::input::InputError;
use crate::cli::Exit;
use crate::report::export::{ExportedFile, Format, contents};
use crate::report::measured::Measured;

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("format").required(true).multiple(true).args(["csv", "excel_csv", "xlsx", "json"])))]
pub struct Export {
    /// A run folder
    run: PathBuf,
    /// CSV for programs: every cell exactly as recorded, RFC 4180, with datapackage.json, which describes the columns
    #[arg(long)]
    csv: bool,
    /// CSV for Excel and LibreOffice: with a byte-order mark; text that they would take for a formula, a number or a
    /// date begins with an apostrophe
    #[arg(long)]
    excel_csv: bool,
    /// A workbook: typed cells, a sheet a table, charts of Table 2 and Figure 4
    #[arg(long)]
    xlsx: bool,
    /// One JSON document: the run, what its columns mean, and all tables
    #[arg(long)]
    json: bool,
    /// Decimal commas and semicolons in CSV, as spreadsheets in much of Europe expect them
    #[arg(long)]
    decimal_comma: bool,
    /// Folder to write to, or the file where one is written; RUN/export without it
    #[arg(long, short)]
    output: Option<PathBuf>,
}

impl Export {
    pub fn run(self) -> Result<Exit> {
        self.check()?;
        let measured = Measured::read(&self.run)?;
        let sheets = contents::sheets(&measured, &self.run)?;
        let mut files = Vec::new();
        for format in self.formats() {
            files.extend(format.files(&measured.info, &sheets, self.decimal_comma)?);
        }
        let mut out = std::io::stdout().lock();
        for file in files {
            let path = self.path(&file);
            let folder = path.parent().unwrap_or(Path::new(""));
            std::fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
            write_whole(&path, &file.bytes).with_context(|| format!("cannot write {}", path.display()))?;
            writeln!(out, "{}", path.display())?;
        }
        Ok(Exit::Done)
    }

    fn formats(&self) -> Vec<Format> {
        let wanted = [
            (self.csv, Format::Csv),
            (self.excel_csv, Format::ExcelCsv),
            (self.xlsx, Format::Xlsx),
            (self.json, Format::Json),
        ];
        wanted.into_iter().filter(|(asked, _)| *asked).map(|(_, format)| format).collect()
    }

    /// What can be said before anything is read.
    fn check(&self) -> Result<(), InputError> {
        let wrong = |key: &str, found: String, allowed: &str| {
            Err(InputError::new("command line", key, found, allowed))
        };
        if !self.run.join("run.json").is_file() {
            let found = format!("`{}`, which holds no run.json", self.run.display());
            return wrong("RUN", found, "allowed are run folders");
        }
        if self.decimal_comma && !self.csv && !self.excel_csv {
            let allowed = "only `--csv` and `--excel-csv` write decimals as text; other formats hold numbers";
            return wrong("--decimal-comma", "given without CSV".to_string(), allowed);
        }
        match &self.output {
            Some(output) if self.single_file().is_none() && is_file(output) => {
                let found = format!("`{}`, which is a file", output.display());
                let allowed =
                    "allowed is a folder; with `--xlsx` or `--json` alone, also a file of that ending";
                wrong("--output", found, allowed)
            }
            Some(_) => Ok(()),
            None => self.refuse_links(),
        }
    }

    /// A run folder that came from elsewhere must not lead out of itself.
    fn refuse_links(&self) -> Result<(), InputError> {
        let below = self.run.join("export");
        for folder in [below.clone(), below.join("csv"), below.join("excel-csv")] {
            if folder.is_symlink() {
                let found = format!("not given, and `{}` is a link", folder.display());
                let allowed = "allowed is any folder; remove the link, or name the folder to write to";
                return Err(InputError::new("command line", "--output", found, allowed));
            }
        }
        Ok(())
    }

    /// The output, if it names the only file that is written.
    fn single_file(&self) -> Option<&Path> {
        let output = self.output.as_deref()?;
        let [format] = self.formats()[..] else { return None };
        let ending = output.extension()?;
        (format.extension()? == ending && !output.is_dir()).then_some(output)
    }

    fn path(&self, file: &ExportedFile) -> PathBuf {
        if let Some(path) = self.single_file() {
            return path.to_path_buf();
        }
        let folder = self.output.clone().unwrap_or_else(|| self.run.join("export"));
        file.folder.map_or(folder.clone(), |kind| folder.join(kind)).join(&file.name)
    }
}

/// Whether a path is a file, or would be one by its name.
fn is_file(path: &Path) -> bool {
    let named =
        path.extension().is_some_and(|ending| ["csv", "xlsx", "json"].iter().any(|known| ending == *known));
    path.is_file() || (named && !path.is_dir())
}
