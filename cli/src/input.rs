//! The flag that bounds input files.

use clap::Args;
use pogema_core::InputLimit;

#[derive(Args, Debug)]
pub struct Input {
    /// Maximum length of an input line, in MiB; a whole file may be four times as large, after decompression
    #[arg(long = "input-limit", value_name = "MIB", default_value_t = 256, value_parser = clap::value_parser!(u64).range(1..))]
    mib: u64,
}

impl Input {
    /// Returns the limit for input lines and files.
    pub fn limit(&self) -> InputLimit {
        InputLimit::of_mib(self.mib)
    }
}
