//! The choice of recordings: a few for each rule that recordings check.

use std::collections::BTreeMap;

use pogema_core::Error;

use super::Vector;
use super::record::{converse, mode_of};
use crate::golden::{self, GoldenRecording};
use crate::port::Mode;
use crate::request::{Record, Response};

/// The maximum number of recordings for each rule.
const NUM_RECORDINGS: usize = 3;
/// The minimum number of operations of a recording.
const MIN_OPS: usize = 12;
/// The minimum number of agents of a recording: fewer agents rarely conflict.
const MIN_AGENTS: usize = 3;

/// A recording, played in a mode.
struct Candidate {
    recording: usize,
    mode: Mode,
    /// The rules that the conversation checks and that are tested in this mode.
    rules: Vec<String>,
    /// The length of the conversation. Units: bytes.
    length: usize,
}

/// Adds recordings of POGEMA 1.4.0 to the vectors of the rules: the shortest conversations that check each rule.
///
/// No conversation is chosen twice.
pub fn add_recordings(by_rule: &mut BTreeMap<String, Vec<Vector>>) -> Result<(), Error> {
    let recordings = recordings()?;
    let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
    for candidate in candidates(&recordings)? {
        let needs_more = |rule: &&String| numbers.get(*rule).is_none_or(|number| *number < NUM_RECORDINGS);
        let Some(rule) = candidate.rules.iter().find(needs_more) else { continue };
        *numbers.entry(rule.clone()).or_default() += 1;
        let (name, recording) = &recordings[candidate.recording];
        let conversation = converse(name, candidate.mode, &recording.request, &recording.response)?;
        let vector = conversation.vector(name.clone(), rule, None, &recording.response);
        by_rule.entry(rule.clone()).or_default().push(vector);
    }
    Ok(())
}

fn is_rich(response: &Response) -> bool {
    let num_agents = response.records.iter().filter_map(Record::state).map(|state| state.cells.len()).max();
    response.records.len() >= MIN_OPS && num_agents.is_some_and(|number| number >= MIN_AGENTS)
}

/// Returns the recordings with enough operations and agents, each with its name.
fn recordings() -> Result<Vec<(String, GoldenRecording)>, Error> {
    let mut recordings = Vec::new();
    let root = golden::folder();
    for path in golden::recording_files(&root)? {
        let file = path.strip_prefix(&root).unwrap_or(&path).display().to_string();
        let all = golden::read(&path)?.into_iter().enumerate();
        let rich = all.filter(|(_, recording)| is_rich(&recording.response));
        recordings.extend(rich.map(|(index, recording)| (format!("{file} line {}", index + 1), recording)));
    }
    Ok(recordings)
}

/// Returns the candidates, shortest first.
fn candidates(recordings: &[(String, GoldenRecording)]) -> Result<Vec<Candidate>, Error> {
    let mut candidates = Vec::new();
    for (number, (name, recording)) in recordings.iter().enumerate() {
        for mode in [Mode::Instance, Mode::Config] {
            let conversation = converse(name, mode, &recording.request, &recording.response)?;
            let compared = conversation.judged.tally.rules.iter().filter(|(_, count)| count.checked > 0);
            let rules = compared.map(|(rule, _)| rule.clone()).filter(|rule| mode_of(rule) == mode).collect();
            let text = serde_json::to_string(&conversation.exchanges);
            let length = text.map_err(|error| Error::io(name, error))?.len();
            candidates.push(Candidate { recording: number, mode, rules, length });
        }
    }
    candidates.sort_by_key(|candidate| (candidate.length, candidate.recording));
    Ok(candidates)
}
