//! `pogema port`: serves a built-in engine as a port.

use clap::Args;
use pogema_conformance::NamedEngine;
use pogema_conformance::port::serve;
use pogema_core::Error;
use pogema_fast::SimdPath;

use crate::conform::ENGINES;
use crate::input::Input;

#[derive(Args, Debug)]
pub struct Port {
    /// Engine that answers
    #[arg(long, default_value = NamedEngine::REFERENCE.name, value_parser = ENGINES.map(|engine| engine.name))]
    engine: String,
    #[command(flatten)]
    input: Input,
}

impl Port {
    pub fn run(&self) -> Result<(), Error> {
        // Reports an invalid `POGEMA_SIMD` now: the fast engine would reject every instance with it.
        SimdPath::from_environment()?;
        let named = ENGINES.into_iter().find(|engine| engine.name == self.engine);
        let input = self.input.limit().lines(std::io::stdin().lock());
        serve(named.unwrap_or(NamedEngine::REFERENCE), input, std::io::stdout().lock())
    }
}
