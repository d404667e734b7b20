//! Unpacks the published results once for all tests.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use pogema_toolbox::Results;

/// The folder named by `POGEMA_PUBLISHED`, and a folder with its unpacked archive.
pub struct Published {
    pub folder: PathBuf,
    unpacked: PathBuf,
}

static PUBLISHED: LazyLock<Option<Published>> = LazyLock::new(|| {
    let folder = PathBuf::from(std::env::var_os("POGEMA_PUBLISHED").filter(|folder| !folder.is_empty())?);
    // Not a temporary folder: nothing drops a static, so it would never be deleted.
    let unpacked = Path::new(env!("CARGO_TARGET_TMPDIR")).join("published");
    let archive = folder.join("results-mapf.tar.gz");
    assert!(archive.exists(), "{} is missing", archive.display());
    let archive = flate2::read::GzDecoder::new(File::open(archive).unwrap());
    tar::Archive::new(archive).unpack(&unpacked).unwrap();
    Some(Published { folder, unpacked })
});

/// Returns the published results; without them, prints that `what` is not checked.
pub fn published(what: &str) -> Option<&'static Published> {
    if PUBLISHED.is_none() {
        eprintln!("SKIPPED: {what}: POGEMA_PUBLISHED does not name the folder of the published results");
    }
    PUBLISHED.as_ref()
}

impl Published {
    pub fn set(&self, name: &str) -> PathBuf {
        self.unpacked.join("results-mapf").join(name)
    }

    pub fn read(&self, sets: &[&str]) -> Results {
        Results::read(&sets.iter().map(|set| self.set(set)).collect::<Vec<_>>()).unwrap()
    }

    pub fn csv(&self, name: &str) -> Vec<csv::StringRecord> {
        csv_rows(&self.folder.join(name))
    }
}

fn csv_rows(path: &Path) -> Vec<csv::StringRecord> {
    csv::ReaderBuilder::new()
        .has_headers(false)
        .from_path(path)
        .unwrap()
        .records()
        .collect::<Result<_, _>>()
        .unwrap()
}
