//! Priority inheritance with backtracking (PIBT): one-shot and lifelong planners, and the step they share.
//!
//! Source: Okumura, Machida, Défago, Tamura, "Priority Inheritance with Backtracking for Iterative Multi-agent Path
//! Finding", AIJ 2022.
//!
//! | paper | here |
//! | --- | --- |
//! | p | [`priorities`] |
//! | Algorithm 1 | [`step`] |

pub(crate) mod guidance;
pub(crate) mod input;
mod lifelong;
mod planner;
pub(crate) mod priorities;
pub(crate) mod step;
mod swap;

pub use guidance::GuidanceParams;
pub use lifelong::PibtLifelong;
pub use planner::{Pibt, PibtParams};
pub use step::PibtRules;
