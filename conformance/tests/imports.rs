//! Checks that no two files of a crate import each other. Only a module and the modules inside it may do so.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::MetadataCommand;
use pogema_conformance::golden;

/// The path of a module, or of a name in it, from the root of its crate.
type Names = Vec<String>;

/// The modules of a crate and their re-exports.
struct Sources {
    /// The text of each module, without comments and tests.
    texts: BTreeMap<Names, String>,
    /// The origin of each name that a module re-exports.
    reexports: BTreeMap<Names, Names>,
}

impl Sources {
    fn read(folder: &Path) -> Self {
        let mut texts = BTreeMap::new();
        for path in golden::files(folder, ".rs").unwrap() {
            let local = path.strip_prefix(folder).unwrap().with_extension("");
            let names = local.iter().map(|name| name.to_string_lossy().into_owned());
            let names = names.filter(|name| !["lib", "main", "mod"].contains(&name.as_str())).collect();
            let text = std::fs::read_to_string(&path).unwrap();
            // Imports may follow the declaration `mod tests;`, so only an inline module ends the text.
            let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
            texts.insert(names, lines.collect::<Vec<_>>().join(" "));
        }
        let mut sources = Self { texts, reexports: BTreeMap::new() };
        for (module, text) in &sources.texts {
            for (is_public, path) in uses(text) {
                if let (true, Some(from)) = (is_public, sources.absolute(module, &path)) {
                    let mut name = module.clone();
                    name.extend(from.last().cloned());
                    sources.reexports.insert(name, from);
                }
            }
        }
        sources
    }

    /// Returns a path from the root of the crate, or `None` for a path into another crate.
    fn absolute(&self, module: &Names, path: &str) -> Option<Names> {
        let mut names: Names = path.split("::").map(str::to_owned).collect();
        let mut base = module.clone();
        match names[0].as_str() {
            "crate" => base.clear(),
            "self" => {}
            "super" => _ = base.pop(),
            first => {
                base.push(first.to_owned());
                return self.texts.contains_key(&base).then(|| [module.clone(), names].concat());
            }
        }
        names.remove(0);
        while names.first().is_some_and(|name| name == "super") {
            base.pop();
            names.remove(0);
        }
        Some([base, names].concat())
    }

    /// Returns the module that defines a name.
    fn module_of(&self, name: &Names) -> Names {
        let mut name = name.clone();
        // Chains of re-exports are short; the limit ends a cyclic one.
        for _ in 0..8 {
            let longest = (0..=name.len()).rev().find(|&length| self.texts.contains_key(&name[..length]));
            let length = longest.unwrap_or(0);
            match self.reexports.get(&name[..name.len().min(length + 1)]) {
                Some(from) if length < name.len() => {
                    name = [from.clone(), name[length + 1..].to_vec()].concat();
                }
                _ => return name[..length].to_vec(),
            }
        }
        name
    }

    fn imports(&self) -> BTreeSet<(Names, Names)> {
        let mut imports = BTreeSet::new();
        for (module, text) in &self.texts {
            for (_, path) in uses(text) {
                let Some(name) = self.absolute(module, &path) else { continue };
                let other = self.module_of(&name);
                if other != *module && !other.starts_with(module) && !module.starts_with(&other) {
                    imports.insert((module.clone(), other));
                }
            }
        }
        imports
    }
}

/// Returns every path that a text imports, and whether the import is public.
fn uses(text: &str) -> Vec<(bool, String)> {
    let mut all = Vec::new();
    for (index, _) in text.match_indices("use ") {
        let before = &text[..index];
        if before.ends_with(|letter: char| letter.is_alphanumeric() || letter == '_') {
            continue;
        }
        let Some((tree, _)) = text[index + 4..].split_once(';') else { continue };
        let is_public = before.trim_end().ends_with("pub") || before.trim_end().ends_with("pub(crate)");
        expand("", tree, &mut |path| all.push((is_public, path.to_owned())));
    }
    all
}

/// Passes each path of a tree such as `a::{b, c::{d, e as f}}` to `take`.
fn expand(prefix: &str, tree: &str, take: &mut impl FnMut(&str)) {
    let (mut depth, mut begin) = (0, 0);
    let ends = tree.char_indices().chain([(tree.len(), ',')]);
    for (index, letter) in ends {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let part = tree[begin..index].trim();
                begin = index + 1;
                match part.split_once('{') {
                    Some((head, rest)) => {
                        expand(&format!("{prefix}{head}"), rest.strip_suffix('}').unwrap_or(rest), take);
                    }
                    None if part.is_empty() => {}
                    None => take(format!("{prefix}{part}").split(" as ").next().unwrap_or_default()),
                }
            }
            _ => {}
        }
    }
}

#[test]
fn a_tree_of_imports_is_expanded() {
    let text = "pub use a::{b, c::{d, e as f}}; use crate::g;";
    let paths = uses(text);
    let public = ["a::b", "a::c::d", "a::c::e"].map(|path| (true, path.to_owned()));
    assert_eq!(paths, [&public[..], &[(false, "crate::g".to_owned())]].concat());
}

#[test]
fn files_that_import_each_other_are_found() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("lib.rs", "mod a;\nmod b;\n"),
        ("a.rs", "use crate::b::B;\n"),
        ("b.rs", "#[cfg(test)]\nmod tests;\n\nuse super::a::A;\n"),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let [a, b] = ["a", "b"].map(|name| vec![name.to_owned()]);
    let expected = BTreeSet::from([(a.clone(), b.clone()), (b, a)]);
    assert_eq!(Sources::read(folder.path()).imports(), expected);
}

#[test]
fn no_two_files_import_each_other() {
    let mut found = Vec::new();
    for package in MetadataCommand::new().no_deps().exec().unwrap().packages {
        let folder = Path::new(&package.manifest_path).parent().unwrap().join("src");
        let imports = Sources::read(&folder).imports();
        let both =
            |(one, other): &&(Names, Names)| one < other && imports.contains(&(other.clone(), one.clone()));
        let name = |pair: &(Names, Names)| {
            format!("{}: {} and {}", package.name, pair.0.join("::"), pair.1.join("::"))
        };
        found.extend(imports.iter().filter(both).map(name));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}
