//! Ports: implementations of the spec in any language, queried over a pipe.
//!
//! | item | content |
//! | --- | --- |
//! | [`Ask`], [`Reply`], [`Hello`] | the protocol |
//! | [`Link`], [`Process`], [`Server`] | the answering side: a child process, or an engine of this workspace |
//! | [`Port`] | a session with a port for one config |
//! | [`Scope`], [`adapt`] | the consequences of a port's claims |
//! | [`play_on_port`] | a port's answer to a complete request |

mod circumstances;
mod claims;
mod group;
mod items;
mod judge;
mod keep;
mod link;
mod minimize;
mod observations;
mod plan;
mod play;
mod process;
mod protocol;
mod report;
mod run;
mod server;
mod session;
mod shrink;
mod shrink_config;
mod subject;
mod test_episode;
mod trace;

pub use claims::{Mode, Scope, Unclaimed, adapt, keys_needed_by, metrics_of, needed_by, profile_of};
pub use group::{Cause, Example, Share};
pub use judge::{Judged, judge};
pub use keep::PROTOCOL_RULE;
pub use keep::text_of;
pub use link::{FaultKind, Link, Misbehaviour};
pub use minimize::shrink_causes;
pub(crate) use observations::resolve_hashes;
pub use plan::{Part, Plan};
pub use play::{Answered, play_on_port};
pub use process::{Command, Process};
pub use protocol::{
    Ask, Beginning, Hello, Key, PROTOCOL, Policy, Profile, Reply, ReplyKey, WireCell, WireChange,
};
pub use report::{PROTOCOL_ROW, PortReport, Verdicts};
pub use run::check_ports;
pub use server::{Server, serve};
pub use session::Port;
pub use subject::Subject;
pub use trace::check_traces;
