//! The check of a port with one request.

use super::claims::{Mode, Scope, Unclaimed, adapt};
use super::link::{Link, Misbehaviour};
use super::play::play_on_port;
use super::protocol::Hello;
use crate::compare::{Divergence, compare_in, misshapen};
use crate::play::play;
use crate::request::{Request, Response};
use crate::tally::Tally;

/// The result of checking a port with one request.
#[derive(Clone, Debug, Default)]
pub struct Judged {
    /// The request that was played, adapted to the port. If the port did not start, the original request; if the port
    /// does not claim a required feature, or there is no instance to play, the default request.
    pub request: Request,
    /// Comparisons by rule, up to the first difference in the state.
    pub tally: Tally,
    /// The first difference of each kind.
    pub divergences: Vec<Divergence>,
    /// The misbehaviour that cut the answer short.
    pub fault: Option<Misbehaviour>,
    /// The features that could not be checked.
    pub not_claimed: Vec<Unclaimed>,
    /// Whether this counts as played: false if a feature that the rule of a case needs is not claimed.
    pub is_played: bool,
}

/// Plays a request on a port and compares its answer with the expected one.
///
/// `expected` is the right answer. If the port's claims require an adapted request, the reference's answer to the
/// adapted request replaces `expected`.
pub fn judge(
    link: &mut dyn Link,
    hello: &Hello,
    mode: Mode,
    request: &Request,
    expected: &Response,
) -> Judged {
    let (adapted, not_claimed) = match adapt(hello, mode, request, expected) {
        Ok(adapted) => adapted,
        Err(unclaimed) => return Judged { not_claimed: vec![unclaimed], ..Judged::default() },
    };
    let mut judged = Judged { not_claimed, ..Judged::default() };
    if mode == Mode::Instance && expected.records.is_empty() {
        return judged;
    }
    let replayed = (adapted != *request).then(|| play(&adapted));
    let expected = replayed.as_ref().unwrap_or(expected);
    let answered = play_on_port(link, hello, mode, &adapted, expected);
    judged.is_played = true;
    judged.fault = answered.fault;
    if judged.fault.is_none() {
        let mut scope = Scope::of(hello, mode);
        // Observations with the wrong shape cannot be compared; everything else can.
        scope.observations &= answered.misshapen.is_none();
        let tally = &mut judged.tally;
        judged.divergences = compare_in(&scope, &adapted, expected, &answered.response, tally);
        judged.divergences.extend(answered.misshapen.map(|(op, got)| misshapen(&adapted, op, got, tally)));
    }
    judged.request = adapted;
    judged
}
