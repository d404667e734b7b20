//! Test vectors: the cases and some recordings as plain JSON, for tests that do not run this kit.
//!
//! A vector is a conversation in the protocol of ports: questions, and the answers of the reference. There is a file
//! for each rule, a manifest with a hash of each file, and a schema. docs/reference/vectors.md describes the format.

mod choose;
mod needs;
mod record;

use std::collections::BTreeMap;
use std::path::{Component, Path};

use pogema_core::files::read_within;
use pogema_core::{Error, SPEC};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::digits::digits_of;
use crate::port::{Profile, profile_of};
use crate::rules;

pub use needs::Needs;

/// The format of the files.
const FORMAT: &str = "pogema-vectors/1";
const MANIFEST: &str = "manifest.json";
const SCHEMA: &str = "schema.json";
/// The schema of the files of rules, without the definitions of the protocol.
const RULE_SCHEMA: &str = include_str!("../../protocol/pogema-vectors-1.schema.json");
const PROTOCOL_SCHEMA: &str = include_str!("../../protocol/pogema-conform-1.schema.json");

/// The keys of a rule's file before the last key, `vectors`.
#[derive(Serialize)]
struct Head<'a> {
    format: &'static str,
    spec: &'static str,
    rule: &'a str,
    profile: Profile,
    statement: &'static str,
}

/// A conversation, and the claims that it requires of an implementation.
#[derive(Clone, Debug, Serialize)]
struct Vector {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    says: Option<String>,
    /// What POGEMA 1.4.0 does instead, if this project deviates from it by decision.
    #[serde(skip_serializing_if = "Option::is_none")]
    pogema: Option<String>,
    needs: Needs,
    exchanges: Vec<record::Exchange>,
}

/// The list of all files.
#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    format: String,
    spec: String,
    version: String,
    schema: String,
    files: Vec<Listed>,
}

/// A file in the manifest.
#[derive(Debug, Serialize, Deserialize)]
struct Listed {
    rule: String,
    path: String,
    num_vectors: usize,
    sha256: String,
}

/// The numbers of written files and vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// The number of files of rules.
    pub num_rules: usize,
    /// The number of vectors in them.
    pub num_vectors: usize,
}

/// Writes the files of all rules, the schema and the manifest to a folder.
///
/// Replaces the files of an earlier call.
///
/// # Errors
/// [`Error::Io`] if the folder has files but no manifest of vectors, or cannot be written. [`Error::Port`] if the
/// reference contradicts a recording. Those of [`crate::cases::read`].
pub fn write(folder: &Path) -> Result<Written, Error> {
    let old = files_of(folder)?;
    let by_rule = all()?;
    let mut listed = Vec::new();
    for (rule, vectors) in &by_rule {
        let text = text_of(rule, vectors)?;
        let path = format!("{rule}.json");
        write_file(folder, &path, text.as_bytes())?;
        let sha256 = digits_of(Sha256::digest(&text));
        listed.push(Listed { rule: rule.clone(), path, num_vectors: vectors.len(), sha256 });
    }
    write_file(folder, SCHEMA, &pretty(&schema())?)?;
    for gone in old.iter().filter(|path| listed.iter().all(|file| file.path != **path)) {
        let path = folder.join(gone);
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::io(&path, error));
            }
            _ => {}
        }
    }
    let num_vectors = listed.iter().map(|file| file.num_vectors).sum();
    let written = Written { num_rules: listed.len(), num_vectors };
    let manifest = Manifest {
        format: FORMAT.into(),
        spec: SPEC.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        schema: SCHEMA.into(),
        files: listed,
    };
    write_file(folder, MANIFEST, &pretty(&manifest)?)?;
    Ok(written)
}

/// Returns the schema of the files of rules, with the definitions of the protocol.
pub fn schema() -> Value {
    let parse = |text| serde_json::from_str::<Value>(text).unwrap_or_default();
    let (mut schema, mut protocol) = (parse(RULE_SCHEMA), parse(PROTOCOL_SCHEMA));
    schema["$defs"] = protocol["$defs"].take();
    schema
}

/// Returns the vectors of every rule: first the cases, then the chosen recordings.
fn all() -> Result<BTreeMap<String, Vec<Vector>>, Error> {
    let mut by_rule = record::cases()?;
    choose::add_recordings(&mut by_rule)?;
    Ok(by_rule)
}

/// Returns the files of rules that an earlier call wrote.
fn files_of(folder: &Path) -> Result<Vec<String>, Error> {
    let is_empty = match std::fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_none(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => true,
        Err(error) => return Err(Error::io(folder, error)),
    };
    if is_empty {
        return Ok(Vec::new());
    }
    let read = read_within(&folder.join(MANIFEST), 1 << 28).ok();
    let manifest: Option<Manifest> = read.and_then(|text| serde_json::from_slice(&text).ok());
    let manifest = manifest.filter(|manifest| manifest.format == FORMAT);
    let is_inside =
        |path: &str| Path::new(path).components().all(|part| matches!(part, Component::Normal(_)));
    match manifest {
        Some(manifest) if manifest.files.iter().all(|file| is_inside(&file.path)) => {
            Ok(manifest.files.into_iter().map(|file| file.path).collect())
        }
        _ => Err(Error::io(
            folder,
            "contains other files, expected a new or empty folder, or a folder of vectors",
        )),
    }
}

fn write_file(folder: &Path, name: &str, text: &[u8]) -> Result<(), Error> {
    let path = folder.join(name);
    let parent = path.parent().unwrap_or(folder);
    std::fs::create_dir_all(parent).map_err(|error| Error::io(parent, error))?;
    pogema_core::files::write_whole(&path, text)
}

fn pretty(value: &impl Serialize) -> Result<Vec<u8>, Error> {
    let mut text = serde_json::to_vec_pretty(value).map_err(|error| Error::io(MANIFEST, error))?;
    text.push(b'\n');
    Ok(text)
}

/// Returns the file of a rule, with one line per vector.
fn text_of(rule: &str, vectors: &[Vector]) -> Result<String, Error> {
    let failed = |error: serde_json::Error| Error::io(rule, error);
    let head = Head {
        format: FORMAT,
        spec: SPEC,
        rule,
        profile: profile_of(rule),
        statement: rules::statement_of(rule).unwrap_or_default(),
    };
    let mut text = serde_json::to_string(&head).map_err(failed)?;
    text.truncate(text.len() - 1);
    text.push_str(",\"vectors\":[");
    for (index, vector) in vectors.iter().enumerate() {
        text.push_str(if index == 0 { "\n" } else { ",\n" });
        text.push_str(&serde_json::to_string(vector).map_err(failed)?);
    }
    text.push_str("\n]}\n");
    Ok(text)
}
