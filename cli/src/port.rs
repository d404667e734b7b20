//! `pogema port`: an engine of ours as a port.

use clap::{Args, ValueEnum};
use pogema_conformance::Engine;
use pogema_conformance::port::serve;
use pogema_core::Error;

use crate::conform::FAST;

#[derive(Args, Debug)]
pub struct Port {
    /// Which engine answers
    #[arg(long, value_enum, default_value_t = Which::Reference)]
    engine: Which,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Which {
    Reference,
    Fast,
    Literal,
}

impl Port {
    pub fn run(&self) -> Result<(), Error> {
        let engine = match self.engine {
            Which::Reference => Engine::REFERENCE,
            Which::Fast => FAST,
            Which::Literal => Engine::LITERAL,
        };
        serve(engine, std::io::stdin().lock(), std::io::stdout().lock())
    }
}
