//! Zip archives of MovingAI maps, in the form in which MovingAI distributes them.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Seek, Write};

use pogema_core::{BoxedError, Error, Map, shorten};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use super::movingai::{Water, read_movingai, write_movingai};
use super::set::NamedMap;
use crate::file_name::{extension, is_metadata};
use crate::text::MapText;

/// Maximum number of entries, maps or not.
const MAX_ENTRIES: usize = 100_000;
/// Maximum size of all unpacked maps together. Units: bytes.
const MAX_UNPACKED: u64 = 1 << 28;

/// Reads every `.map` file of a zip archive, sorted by name.
///
/// The name of a map is the name of its file without folder and extension. Files whose names begin with `._`, the
/// metadata of macOS, are skipped.
///
/// # Errors
/// [`Error::Io`] if the file is not a zip archive or has more than 100,000 entries; [`Error::Io`] with the entry's name
/// or number if an entry cannot be unpacked, makes the maps exceed 256 MiB, lies outside the archive's folder, repeats
/// a name, or is not a valid map.
///
/// Source: pogema-toolbox 0.1.1, `moving_ai_ingestion.py`, `download_moving_ai_maps`
pub fn read_archive(archive: impl Read + Seek, water: Water) -> Result<Vec<NamedMap>, Error> {
    let mut archive = ZipArchive::new(archive).map_err(|error| Error::io("archive", error))?;
    if archive.len() > MAX_ENTRIES {
        let reason = format!("{} entries, expected at most {MAX_ENTRIES}", archive.len());
        return Err(Error::io("archive", reason));
    }
    let mut room = MAX_UNPACKED;
    let mut maps: BTreeMap<String, MapText> = BTreeMap::new();
    for index in 0..archive.len() {
        let mut entry =
            archive.by_index(index).map_err(|error| Error::io(format!("entry {index}"), error))?;
        let path = entry.name().to_owned();
        let failed = |cause: BoxedError| Error::io(shorten(&path, Error::LONGEST_QUOTE), cause);
        let inside = entry.enclosed_name().filter(|_| !path.starts_with(['/', '\\']));
        let inside = inside.ok_or_else(|| failed("lies outside the folder of the archive".into()))?;
        if entry.is_dir() || extension(&inside) != "map" || is_metadata(&inside) {
            continue;
        }
        let mut bytes = Vec::new();
        entry.by_ref().take(room + 1).read_to_end(&mut bytes).map_err(|error| failed(error.into()))?;
        room = room.checked_sub(bytes.len() as u64).ok_or_else(|| {
            failed(format!("the maps up to this entry unpack to more than {} MiB", MAX_UNPACKED >> 20).into())
        })?;
        let text = String::from_utf8(bytes).map_err(|error| failed(error.utf8_error().into()))?;
        let map = read_movingai(&text, water).map_err(|error| failed(error.into()))?;
        let name = inside.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if maps.insert(name.clone(), MapText::from(map)).is_some() {
            return Err(failed(format!("a second map named `{name}`").into()));
        }
    }
    Ok(maps.into_iter().map(|(name, text)| NamedMap { name, text }).collect())
}

/// Packs maps into a zip archive of `.map` files.
///
/// # Errors
/// [`Error::Io`] if a name is not a file name, or occurs twice.
pub fn write_archive<'a>(maps: impl IntoIterator<Item = (&'a str, &'a Map)>) -> Result<Vec<u8>, Error> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    // A fixed modification time, so that equal maps give equal bytes.
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    for (name, map) in maps {
        let failed = |cause: BoxedError| Error::io(name, cause);
        if name.is_empty() || name.contains(['/', '\\', '\0']) || name == "." || name == ".." {
            return Err(failed("is not a file name".into()));
        }
        writer.start_file(format!("{name}.map"), options).map_err(|error| failed(error.into()))?;
        writer.write_all(write_movingai(map).as_bytes()).map_err(|error| failed(error.into()))?;
    }
    let written = writer.finish().map_err(|error| Error::io("archive", error))?;
    Ok(written.into_inner())
}
