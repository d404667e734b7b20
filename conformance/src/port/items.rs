//! Items to check: cases, recordings and random episodes.

use std::path::Path;

use pogema_core::Error;

use super::plan::{Part, Plan};
use crate::cases::{self, Case};
use crate::draw::draw_extended_request;
use crate::golden::{self, GoldenRecording};
use crate::play::{NamedEngine, play};
use crate::request::{Request, Response};
use crate::script::play_script;

/// One item to check.
pub enum Item {
    Case(String, Box<Case>),
    /// A case in a file that the caller names. It is an episode like any other, regardless of its rule.
    File(String, Box<Case>),
    Recorded(String, Box<GoldenRecording>),
    Drawn(u64),
}

impl Item {
    /// Reads the case in a file.
    pub fn of_file(path: &Path) -> Result<Self, Error> {
        Ok(Self::File(path.display().to_string(), Box::new(cases::read(path)?)))
    }

    pub fn name(&self, seed: u64) -> String {
        match self {
            Self::Case(name, _) | Self::File(name, _) | Self::Recorded(name, _) => name.clone(),
            Self::Drawn(number) => format!("random episode {number} of seed {seed}"),
        }
    }

    pub fn case_rule(&self) -> Option<&str> {
        match self {
            Self::Case(_, case) => Some(&case.rule),
            Self::File(..) | Self::Recorded(..) | Self::Drawn(_) => None,
        }
    }

    pub fn request(&self, seed: u64) -> Result<(Request, Response), Error> {
        match self {
            Self::Case(_, case) | Self::File(_, case) => {
                let request = case.request()?;
                let expected = play(&request);
                Ok((request, expected))
            }
            Self::Recorded(_, recording) => Ok((recording.request.clone(), recording.response.clone())),
            Self::Drawn(number) => {
                Ok(play_script(NamedEngine::REFERENCE, draw_extended_request(seed, *number), seed))
            }
        }
    }
}

/// The items of a plan: the items that were read, then any number of random episodes.
#[derive(Default)]
pub struct Items {
    read: Vec<Item>,
    num_drawn: u64,
}

impl Items {
    pub fn len(&self) -> u64 {
        self.num_drawn.saturating_add(self.read.len() as u64)
    }

    /// Calls a function with the item at an index.
    pub fn with<T>(&self, index: u64, use_item: impl FnOnce(&Item) -> T) -> T {
        match self.read.get(usize::try_from(index).unwrap_or(usize::MAX)) {
            Some(item) => use_item(item),
            None => use_item(&Item::Drawn(index - self.read.len() as u64)),
        }
    }
}

/// Returns all items of a plan, cases first.
pub fn items(plan: &Plan) -> Result<Items, Error> {
    let mut items = Vec::new();
    if !plan.files.is_empty() {
        let read = plan.files.iter().map(|path| Item::of_file(path)).collect::<Result<_, _>>()?;
        return Ok(Items { read, num_drawn: 0 });
    }
    let has = |part: Part| plan.parts.is_empty() || plan.parts.contains(&part);
    if has(Part::Cases) {
        add_cases(&mut items, plan)?;
    }
    if has(Part::Recordings) {
        add_recordings(&mut items)?;
    }
    let num_drawn = if has(Part::Drawn) { plan.num_cases } else { 0 };
    Ok(Items { read: items, num_drawn })
}

fn add_cases(items: &mut Vec<Item>, plan: &Plan) -> Result<(), Error> {
    let root = cases::folder();
    for path in golden::files(&root, ".yaml")? {
        let case = cases::read(&path)?;
        // If this project deviates from POGEMA by decision, a port may follow POGEMA.
        let is_selected = plan.rules.as_ref().is_none_or(|rules| rules.matches(&case.rule));
        if case.pogema.is_none() && is_selected {
            items.push(Item::Case(relative(&path, &root), Box::new(case)));
        }
    }
    Ok(())
}

fn add_recordings(items: &mut Vec<Item>) -> Result<(), Error> {
    for folder in [golden::folder(), golden::found_folder()] {
        for path in golden::recording_files(&folder)? {
            for (index, recording) in golden::read(&path)?.into_iter().enumerate() {
                let name = format!("{} line {}", relative(&path, &folder), index + 1);
                items.push(Item::Recorded(name, Box::new(recording)));
            }
        }
    }
    Ok(())
}

fn relative(path: &Path, root: &Path) -> String {
    path.strip_prefix(root.parent().unwrap_or(root)).unwrap_or(path).display().to_string()
}
