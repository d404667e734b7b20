//! Checks that every rule has one statement, code, a case and a picture, and that every cited rule exists.
//!
//! These tests also generate the pictures and the index in `docs/spec`, and `conformance/src/rules.txt`. If the
//! environment variable `BLESS` is set, they write them instead of comparing.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use pogema_conformance::{cases, golden, play};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// Returns a path relative to the root of the repository.
fn local(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().display().to_string()
}

#[derive(Default)]
struct Rule {
    chapter: String,
    statement: String,
    code: BTreeSet<String>,
    cases: BTreeSet<String>,
    pictures: usize,
}

fn is_id(text: &str) -> bool {
    let part =
        |part: &str| !part.is_empty() && part.bytes().all(|byte| byte == b'-' || byte.is_ascii_lowercase());
    text.contains('/') && text.split('/').all(part)
}

fn chapters() -> Vec<PathBuf> {
    let files = golden::files(&root().join("docs/spec"), ".md").unwrap();
    files.into_iter().filter(|path| !path.ends_with("index.md")).collect()
}

/// Returns the rules that the spec defines; adds errors in the definitions to `wrong`.
fn defined(wrong: &mut Vec<String>) -> BTreeMap<String, Rule> {
    let mut rules: BTreeMap<String, Rule> = BTreeMap::new();
    for path in chapters() {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut current = None;
        for line in text.lines() {
            if let Some(title) = line.strip_prefix("## ") {
                current = is_id(title).then(|| title.to_owned());
                if let Some(id) = &current {
                    let rule = Rule { chapter: local(&path), ..Rule::default() };
                    if rules.insert(id.clone(), rule).is_some() {
                        wrong.push(format!("{id} is defined twice, the second time in {}", local(&path)));
                    }
                }
            } else if let Some(rule) = current.as_ref().and_then(|id| rules.get_mut(id)) {
                rule.pictures += usize::from(line.starts_with("<!-- case: "));
                if rule.statement.is_empty() && rule.pictures == 0 {
                    line.trim().clone_into(&mut rule.statement);
                }
            }
        }
    }
    rules
}

/// Returns the rules that sources cite, each with the file.
fn cited_in_code() -> Vec<(String, String)> {
    let mut cited = Vec::new();
    for package in cargo_metadata::MetadataCommand::new().no_deps().exec().unwrap().packages {
        let folder = Path::new(&package.manifest_path).parent().unwrap();
        for path in golden::files(&folder.join("src"), ".rs").unwrap() {
            cited.extend(cited_in(&path, |line| line.starts_with("//")));
        }
    }
    cited
}

/// Returns the rules that the sources of the Python package cite, each with the file.
fn cited_in_python() -> Vec<(String, String)> {
    let files = golden::files(&root().join("python/pogema_rs"), ".py").unwrap();
    files.iter().flat_map(|path| cited_in(path, |line| line.starts_with("Rule: "))).collect()
}

/// Returns the rules that a file cites in the lines that are comments.
fn cited_in(path: &Path, is_comment: impl Fn(&str) -> bool) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|line| is_comment(line.trim_start()));
    let lists = lines.filter_map(|line| Some(line.split_once("Rule: ")?.1));
    let ids = lists.flat_map(|ids| ids.split(','));
    ids.map(|id| (id.trim().trim_end_matches('.').to_owned(), local(path))).collect()
}

/// Returns the rules that reports can cite.
fn cited_in_reports() -> BTreeSet<String> {
    let mut cited = BTreeSet::new();
    for path in golden::files(&root().join("conformance/src"), ".rs").unwrap() {
        let text = std::fs::read_to_string(&path).unwrap();
        cited.extend(text.split('"').skip(1).step_by(2).filter(|word| is_id(word)).map(str::to_owned));
    }
    cited
}

#[test]
fn every_rule_has_a_statement_code_a_case_and_a_picture() {
    let mut wrong = Vec::new();
    let mut rules = defined(&mut wrong);
    for (id, file) in cited_in_code() {
        match rules.get_mut(&id) {
            Some(rule) => drop(rule.code.insert(file)),
            None => wrong.push(format!("{file} cites `{id}`, which is not defined")),
        }
    }
    let in_python = cited_in_python();
    assert!(in_python.len() > 40, "only {} citations found in Python", in_python.len());
    let unknown = in_python.iter().filter(|(id, _)| !rules.contains_key(id));
    wrong.extend(unknown.map(|(id, file)| format!("{file} cites `{id}`, which is not defined")));
    for path in golden::files(&cases::folder(), ".yaml").unwrap() {
        let (id, file) = (cases::read(&path).unwrap().rule, local(&path));
        match rules.get_mut(&id) {
            Some(rule) => drop(rule.cases.insert(file)),
            None => wrong.push(format!("{file} shows `{id}`, which is not defined")),
        }
    }
    let family = |id: &str| id.split('/').next().map(str::to_owned);
    let families: BTreeSet<_> = rules.keys().filter_map(|id| family(id)).collect();
    for id in cited_in_reports() {
        if family(&id).is_some_and(|name| families.contains(&name)) && !rules.contains_key(&id) {
            wrong.push(format!("reports cite `{id}`, which is not defined"));
        }
    }
    for (id, rule) in &rules {
        let missing = [
            ("statement", rule.statement.len() < 40),
            ("code", rule.code.is_empty()),
            ("case", rule.cases.is_empty()),
            ("picture", rule.pictures == 0),
        ];
        wrong.extend(
            missing
                .iter()
                .filter(|(_, is_missing)| *is_missing)
                .map(|(what, _)| format!("{id} has no {what}")),
        );
    }
    assert!(rules.len() > 40, "only {} rules found", rules.len());
    check_text(&root().join("docs/spec/index.md"), &index(&rules), &mut wrong);
    check_text(&root().join("conformance/src/rules.txt"), &table(&rules), &mut wrong);
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn every_picture_matches_its_case() {
    let mut wrong = Vec::new();
    for path in chapters() {
        let text = std::fs::read_to_string(&path).unwrap();
        check_text(&path, &with_pictures(&text, &mut wrong), &mut wrong);
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

fn check_text(path: &Path, expected: &str, wrong: &mut Vec<String>) {
    if std::fs::read_to_string(path).is_ok_and(|text| text == expected) {
        return;
    }
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(path, expected).unwrap();
    } else {
        wrong.push(format!("{} is out of date; `BLESS=1 ./check rules` writes it", local(path)));
    }
}

/// Generates the page with all rules.
fn index(rules: &BTreeMap<String, Rule>) -> String {
    let mut text = String::from(
        "# All rules\n\nThis page lists, for every rule, the Rust source files that cite it and the number of its \
         cases. `BLESS=1 ./check rules` generates the page.\n\n\
         | rule | code | cases |\n| --- | --- | --- |\n",
    );
    for (id, rule) in rules {
        let chapter = rule.chapter.trim_start_matches("docs/spec/");
        let anchor = id.replace('/', "");
        let code: Vec<String> = rule.code.iter().map(|file| format!("`{file}`")).collect();
        let _ = writeln!(text, "| [{id}]({chapter}#{anchor}) | {} | {} |", code.join(" "), rule.cases.len());
    }
    text.push_str(
        "\n**What next:** [Config](config.md), or the chapter of the rule that you are looking for.\n",
    );
    text
}

/// Generates the table of rules that the reports quote: each name with the first sentence of the statement, without its
/// links. If that sentence is short, the next sentences follow.
fn table(rules: &BTreeMap<String, Rule>) -> String {
    const MIN_LENGTH: usize = 80;
    let mut text = String::new();
    for (id, rule) in rules {
        let mut sentence = String::new();
        let mut end = 0;
        for part in rule.statement.split_inclusive(". ") {
            end += part.len();
            if end >= MIN_LENGTH {
                break;
            }
        }
        let mut rest = rule.statement[..end].trim_end();
        while let Some((before, name, after)) = rest.split_once("](").and_then(|(link, target)| {
            let (before, name) = link.rsplit_once('[')?;
            Some((before, name, target.split_once(')')?.1))
        }) {
            sentence.push_str(before);
            sentence.push_str(name);
            rest = after;
        }
        let _ = writeln!(text, "{id}\t{sentence}{rest}");
    }
    text
}

/// Returns a chapter with every picture block filled in.
fn with_pictures(text: &str, wrong: &mut Vec<String>) -> String {
    let mut result = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let _ = writeln!(result, "{line}");
        let Some(name) = line.strip_prefix("<!-- case: ").and_then(|rest| rest.strip_suffix(" -->")) else {
            continue;
        };
        let path = cases::folder().join(format!("{name}.yaml"));
        match cases::read(&path) {
            Ok(case) => {
                let picture = case.draw(&play(&case.request().unwrap()));
                let _ = write!(result, "```text\n{picture}\n```\n");
            }
            Err(error) => wrong.push(error.to_string()),
        }
        if !lines.by_ref().any(|line| line == "<!-- /case -->") {
            wrong.push(format!("the picture of {name} has no end"));
        }
        result.push_str("<!-- /case -->\n");
    }
    result
}
