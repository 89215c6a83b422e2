use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::base::input::InputError;
use crate::cli::Exit;
use crate::cli::output::Output;
use crate::report::archive;

#[derive(Debug, Args)]
pub struct Archive {
    /// A run folder
    run: PathBuf,
    /// The archive [default: the run folder's name with .zip, beside it]
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Pack a run that is not finished
    #[arg(long)]
    unfinished: bool,
}

impl Archive {
    pub fn run(self, output: Output) -> Result<Exit> {
        let file = match &self.output {
            Some(file) => file.clone(),
            None => self.beside()?,
        };
        let packed = archive::write(&self.run, &file, self.unfinished)?;
        output.show(&packed, |out| writeln!(out, "{} ({} files)", file.display(), packed.len()))?;
        Ok(Exit::Done)
    }

    fn beside(&self) -> Result<PathBuf, InputError> {
        let mut name = self.run.file_name().map(ToOwned::to_owned).ok_or_else(|| {
            let found = format!("`{}`, which has no name of its own", self.run.display());
            InputError::new("command line", "RUN", found, "name the archive with `--output`")
        })?;
        name.push(".zip");
        Ok(self.run.with_file_name(name))
    }
}
