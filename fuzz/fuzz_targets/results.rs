//! Fuzzes a folder of results: no file in it makes a reader or a resumed run panic.
//!
//! The input holds four files, separated by `%`: rows, episodes, the lines of an unfinished algorithm, and the
//! manifest. If a part is empty, its file is not written.
#![no_main]

use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use std::{env, fs, process};

use libfuzzer_sys::fuzz_target;
use pogema_maps::Library;
use pogema_toolbox::{Begin, EpisodeConfigs, Manifest, Progress, Results, Store, Suite};

const FILES: [&str; 4] = ["A*.json", "A*.episodes.json", "A*.jsonl", "about.json"];
const KEY: &str = "A*";
const NUM_EPISODES: usize = 2;

static FOLDER: LazyLock<PathBuf> =
    LazyLock::new(|| env::temp_dir().join(format!("pogema-fuzz-results-{}", process::id())));

static SUITE: LazyLock<Suite> = LazyLock::new(|| {
    let text = "environment: {name: Environment, num_agents: 1, seed: {grid_search: [0, 1]}}\nalgorithms: {A*: {name: A*}}";
    Suite::parse(Path::new("suite.yaml"), text).expect("a valid suite")
});

fuzz_target!(|input: &[u8]| {
    let _ = fs::remove_dir_all(&*FOLDER);
    fs::create_dir_all(&*FOLDER).expect("a folder");
    let files = input.split(|&byte| byte == b'%').zip(FILES);
    for (part, name) in files.filter(|(part, _)| !part.is_empty()) {
        fs::write(FOLDER.join(name), part).expect("a file");
    }
    if let Ok(results) = Results::read(std::slice::from_ref(&*FOLDER)) {
        let _ = results.algorithms();
    }
    let _ = Manifest::read(&FOLDER);
    let environments = EpisodeConfigs::unchecked(&SUITE, Library::empty());
    if let Ok(store) = Store::open(&FOLDER, &SUITE, &environments, Begin::Resume) {
        if let Ok(Some(progress)) = Progress::open(&Arc::new(store), KEY, NUM_EPISODES) {
            assert!(progress.num_done() <= NUM_EPISODES && progress.to_do().len() <= NUM_EPISODES);
        }
    }
});
