//! Tests of the reports of `pogema conform --port`: JUnit XML, a page, a badge, and known deviations.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
mod program;

use std::path::Path;
use std::process::Command;

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use common::{CROWDED, write_wrong_port};
use program::pogema;

/// A built-in engine as a port.
const CONFORMING: &str = concat!("'", env!("CARGO_BIN_EXE_pogema"), "' port");
const WRONG: &str = "python3.11 wrong.py";

/// A part of the template, and the text that replaces it to plant an error.
const LATE: [&str; 2] = ["self.steps >= self.max_steps", "self.steps > self.max_steps"];
const NO_ACTIVE: [&str; 2] = [r#", "active": environment.active}"#, "}"];
/// Like [`NO_ACTIVE`], but the error occurs too rarely to cut the run short.
const SOMETIMES_NO_ACTIVE: [&str; 2] = [
    "    return {**state, **results",
    "    if len(environment.cells) > 20: del state[\"active\"]\n    return {**state, **results",
];
/// Like [`NO_ACTIVE`], but only with one agent.
const NO_ACTIVE_ALONE: [&str; 2] = [
    "    return {**state, **results",
    "    if len(environment.cells) == 1: del state[\"active\"]\n    return {**state, **results",
];
const NAMED: [&str; 2] = [r#""name": "template""#, r#""name": "<b>&\"'\x1b[2J""#];

const KNOWN_LATE: &str =
    "- {rule: end/truncated, what: truncated, since: 2026-11-22, reason: one step late}\n";

/// Returns a folder with `wrong.py`, a port with planted errors.
fn folder(wrong: &[[&str; 2]]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_wrong_port(&folder.path().join("wrong.py"), wrong);
    let python = Command::new("python3.11").arg("--version").output();
    assert!(python.is_ok_and(|output| output.status.success()), "python3.11 is needed");
    folder
}

/// Checks a port and writes all reports; skips the recordings, which take a long time.
fn conform(folder: &Path, port: &str, more: &[&str]) -> (i32, String) {
    conform_whole(folder, port, &[&["--part", "cases", "--part", "drawn"], more].concat())
}

/// Checks a port with all parts and writes all reports.
fn conform_whole(folder: &Path, port: &str, more: &[&str]) -> (i32, String) {
    let files = ["--junit", "report.xml", "--html", "report.html", "--badge", "badge.svg"];
    let first = ["--port", port, "--cases", "50", "--workers", "1"];
    status_and_text(folder, &[&first, &files[..], more].concat())
}

#[test]
fn a_run_that_checks_nothing_fails() {
    let folder = folder(&[]);
    let nothing = ["--port", "python3.11 wrong.py", "--part", "cases", "--rules", "metrics*"];
    let (status, text) = status_and_text(folder.path(), &[&nothing[..], &["--junit", "report.xml"]].concat());
    assert!(text.contains("nothing was checked"), "{text}");
    assert_eq!(status, 1);
    assert_eq!(failures(&suite(folder.path())), ["(nothing checked)"]);
}

/// Runs `pogema conform`; returns the exit status and standard output.
fn status_and_text(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let (text, _, status) = pogema(folder, &[&["conform"], arguments].concat());
    (status, text)
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

/// Reads the suites of the JUnit report and checks their counts.
fn suites(folder: &Path) -> Vec<TestSuite> {
    let text = read(folder, "report.xml");
    let xml = roxmltree::Document::parse(&text).unwrap();
    for suite in xml.descendants().filter(|node| node.has_tag_name("testsuite")) {
        let num_elements =
            |tag| suite.descendants().filter(|node| node.has_tag_name(tag)).count().to_string();
        for (count, tag) in
            [("tests", "testcase"), ("failures", "failure"), ("errors", "error"), ("skipped", "skipped")]
        {
            assert_eq!(suite.attribute(count), Some(num_elements(tag).as_str()), "{count}");
        }
    }
    Report::deserialize_from_str(&text).unwrap().test_suites
}

/// Reads the suite of the only port.
fn suite(folder: &Path) -> TestSuite {
    let mut suites = suites(folder);
    assert_eq!(suites.len(), 1);
    suites.remove(0)
}

fn case<'a>(suite: &'a TestSuite, rule: &str) -> &'a TestCase {
    suite.test_cases.iter().find(|case| case.name.as_str() == rule).unwrap()
}

fn failures(suite: &TestSuite) -> Vec<&str> {
    let is_bad = |case: &&TestCase| matches!(case.status, TestCaseStatus::NonSuccess { .. });
    suite.test_cases.iter().filter(is_bad).map(|case| case.name.as_str()).collect()
}

fn skip_message(case: &TestCase) -> Option<&str> {
    match &case.status {
        TestCaseStatus::Skipped { message, .. } => message.as_ref().map(quick_junit::XmlString::as_str),
        _ => None,
    }
}

/// Reads the page and checks that it is well-formed and loads nothing.
fn page(folder: &Path) -> String {
    let text = read(folder, "report.html");
    assert!(text.contains("Content-Security-Policy\" content=\"default-src 'none'"), "{text}");
    assert_loads_nothing(&text);
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    let page = roxmltree::Document::parse_with_options(&text, options).unwrap();
    for link in page.descendants().filter_map(|node| node.attribute("href")) {
        let is_section = |id: &str| page.descendants().any(|node| node.attribute("id") == Some(id));
        let leads_on = link.starts_with("https://pogema-rs.github.io/pogema-rs/spec/");
        assert!(leads_on || link.strip_prefix('#').is_some_and(is_section), "{link}");
    }
    // All rows of a table have the same width, the head included.
    for table in page.descendants().filter(|node| node.has_tag_name("table")) {
        let rows = table.descendants().filter(|node| node.has_tag_name("tr")).map(|row| {
            let span =
                |cell: roxmltree::Node| cell.attribute("colspan").map_or(1, |span| span.parse().unwrap());
            row.children().filter(roxmltree::Node::is_element).map(span).sum()
        });
        assert_eq!(rows.collect::<std::collections::BTreeSet<usize>>().len(), 1);
    }
    text
}

fn assert_loads_nothing(text: &str) {
    for loads in ["src=", "@import", "url(", "<link", "<script", "<iframe"] {
        assert!(!text.contains(loads), "{loads}");
    }
}

fn badge(folder: &Path) -> String {
    let text = read(folder, "badge.svg");
    assert_loads_nothing(&text);
    let svg = roxmltree::Document::parse(&text).unwrap();
    let title = svg.descendants().find(|node| node.has_tag_name("title")).unwrap();
    title.text().unwrap().to_owned()
}

#[test]
fn a_conforming_port_is_reported_as_conforming() {
    let folder = folder(&[]);
    let (status, text) = conform(folder.path(), CONFORMING, &[]);
    assert_eq!(status, 0, "{text}");
    let suite = &suite(folder.path());
    assert_eq!(suite.name.as_str(), "reference");
    assert_eq!(failures(suite), [""; 0]);
    assert_eq!(case(suite, "collide/soft/swap").classname.as_ref().unwrap().as_str(), "reference");
    let page = page(folder.path());
    assert!(
        page.contains("#collidesoftswap\">collide/<wbr/>soft/<wbr/>swap</a>") && !page.contains("<article")
    );
    let badge = badge(folder.path());
    assert!(badge.starts_with("reference: POGEMA 1.4.0, conforms "), "{badge}");
}

#[test]
fn every_report_lists_the_failures() {
    let folder = folder(&[LATE, CROWDED]);
    let (status, text) = conform(folder.path(), WRONG, &[]);
    assert_eq!(status, 1, "{text}");
    let suite = &suite(folder.path());
    let failures = failures(suite);
    for (rule, what) in [("collide/priority", "cell"), ("end/truncated", "truncated")] {
        assert!(text.contains(&format!("FAIL {rule}: {what} differs")) && failures.contains(&rule), "{text}");
        let TestCaseStatus::NonSuccess { description: Some(description), .. } = &case(suite, rule).status
        else {
            panic!("{rule} passes")
        };
        let description = description.as_str();
        for part in ["  expected ", "  got  ", "agents and goals", "play it again: pogema conform --port"] {
            assert!(description.contains(part), "{part} in {description}");
        }
    }
    let message = skip_message(case(suite, "metrics/finish"));
    assert_eq!(message, Some("not claimed: profile metrics"));
    let page = page(folder.path());
    for part in [
        "#collidepriority\">collide/<wbr/>priority</a>: cell differs",
        "rule: end/truncated",
        "end-truncated",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let drawings = |what: &str| page.matches(&format!("<figcaption>{what}</figcaption><svg ")).count();
    assert_eq!(["before", "expected", "got"].map(drawings), [2, 2, 2]);
    let badge = badge(folder.path());
    assert!(badge.starts_with("template: POGEMA 1.4.0, diverges "), "{badge}");
}

#[test]
fn a_misbehaving_port_is_an_error_and_its_name_is_escaped() {
    let folder = folder(&[NO_ACTIVE, NAMED]);
    let (status, text) = conform(folder.path(), WRONG, &[]);
    assert_eq!(status, 3, "{text}");
    assert!(!text.contains('\x1b'), "{text}");
    let suite = &suite(folder.path());
    let is_error = |case: &TestCase| {
        matches!(case.status, TestCaseStatus::NonSuccess { kind: NonSuccessKind::Error, .. })
    };
    assert!(suite.test_cases.iter().any(is_error));
    assert!(page(folder.path()).contains("<h3>protocol: "));
    assert!(badge(folder.path()).starts_with("<b>&\"'[2J: POGEMA 1.4.0, misbehaves "));
}

#[test]
fn several_ports_are_compared_side_by_side() {
    let folder = folder(&[LATE]);
    let files = ["--junit", "report.xml", "--html", "report.html"];
    let played = ["--rules", "end/*", "--cases", "50", "--part", "cases", "--part", "drawn"];
    let ports = ["--port", CONFORMING, "--port", WRONG];
    let (status, text) = status_and_text(folder.path(), &[&ports, &files[..], &played].concat());
    assert_eq!(status, 1, "{text}");
    assert_eq!(text.lines().filter(|line| line.starts_with("│ end/truncated")).count(), 1, "{text}");
    let suites = suites(folder.path());
    let failing: Vec<bool> = suites.iter().map(|suite| failures(suite).contains(&"end/truncated")).collect();
    assert_eq!(failing, [false, true]);
    assert!(page(folder.path()).contains(r#"<th scope="colgroup" colspan="4">template</th>"#));
}

#[test]
fn known_deviations_are_listed_separately_and_accepted() {
    let folder = folder(&[LATE]);
    let known = "- {rule: metrics/finish, what: metrics, since: 2026-01-31, reason: not claimed any more}\n";
    let other = "- {rule: collide/priority, what: cell, since: 2026-01-31, reason: it was so, port: other}\n";
    std::fs::write(folder.path().join("known.yaml"), format!("{KNOWN_LATE}{known}{other}")).unwrap();
    let (status, text) = conform(folder.path(), WRONG, &["--known", "known.yaml"]);
    assert_eq!(status, 0, "{text}");
    for part in [
        "KNOWN end/truncated: truncated, ",
        "  since 2026-11-22: one step late\n",
        "conforms to all it claims, except for 1 known: ",
        "not played: metrics/finish: metrics, known since 2026-01-31: not claimed any more",
        "not played: collide/priority: cell of other, known since 2026-01-31: it was so",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert!(!text.contains("FAIL") && !text.contains("STOPPED"), "{text}");
    let suite = &suite(folder.path());
    assert_eq!(failures(suite), [""; 0]);
    let case = case(suite, "end/truncated");
    assert_eq!(skip_message(case), Some("known since 2026-11-22: one step late"));
    assert!(case.system_out.as_ref().unwrap().as_str().contains("agents and goals"));
    assert!(page(folder.path()).contains("<dt>known</dt><dd>since 2026-11-22: one step late</dd>"));
    let badge = badge(folder.path());
    assert!(badge.starts_with("template: POGEMA 1.4.0, known deviations "), "{badge}");
}

#[test]
fn deviations_that_stopped_occurring_fail_the_run() {
    let folder = folder(&[LATE]);
    let fixed =
        "- {rule: reward/own, what: reward, since: 2026-01-31, reason: twice as much, port: template}\n";
    std::fs::write(folder.path().join("known.yaml"), format!("{KNOWN_LATE}{fixed}")).unwrap();
    let (status, text) = conform_whole(folder.path(), WRONG, &["--known", "known.yaml"]);
    let title = "reward/own: reward of template, known since 2026-01-31: twice as much";
    assert_eq!(status, 1, "{text}");
    assert!(
        text.ends_with(&format!("STOPPED {title}\n  it stopped occurring and can be removed from the list")),
        "{text}"
    );
    let suites = suites(folder.path());
    assert_eq!(suites.iter().map(failures).collect::<Vec<_>>(), [vec![], vec![title]]);
    assert!(page(folder.path()).contains(title));
    for left_out in
        [["--rules", "move/*"], ["--part", "cases"], ["--case", "pogema-found/end-truncated-truncated.yaml"]]
    {
        let (status, text) =
            conform_whole(folder.path(), WRONG, &[&["--known", "known.yaml"], &left_out[..]].concat());
        assert_eq!(status, 0, "{left_out:?}: {text}");
        assert!(text.contains(&format!("not played: {title}")), "{left_out:?}: {text}");
    }
}

#[test]
fn known_faults_are_accepted_unless_they_cut_the_run_short() {
    for (wrong, expected_status, expected, failing) in [
        (
            &[NO_ACTIVE][..],
            3,
            "misbehaves only in known ways, but too often to finish the run: ",
            vec!["(not run)"],
        ),
        (&[SOMETIMES_NO_ACTIVE], 0, "except for 1 known: ", vec![]),
        (
            &[NO_ACTIVE_ALONE, LATE],
            3,
            "diverges, and misbehaves in known ways too often to finish the run: 1 cause in ",
            vec!["end/truncated", "(not run)"],
        ),
    ] {
        let folder = folder(wrong);
        let known = "- {rule: protocol, what: left `active` out of an answer that needs it, since: 2026-11-22, reason: r}";
        std::fs::write(folder.path().join("known.yaml"), known).unwrap();
        let (status, text) = conform(folder.path(), WRONG, &["--known", "known.yaml"]);
        assert_eq!(status, expected_status, "{text}");
        assert!(text.contains("KNOWN protocol: left `active` out") && text.contains(expected), "{text}");
        assert_eq!(failures(&suite(folder.path())), failing);
    }
}

#[test]
fn a_site_links_each_failed_rule_to_its_counterexample() {
    let folder = folder(&[LATE]);
    let ports = ["--port", WRONG, "--port", CONFORMING, "--port", "python3.11 same.py", "--part", "cases"];
    std::fs::copy(folder.path().join("wrong.py"), folder.path().join("same.py")).unwrap();
    let site = ["--site", "new/site"];
    let (status, _) = status_and_text(folder.path(), &[&ports[..], &site].concat());
    assert_eq!(status, 1);
    let read = |name: &str| std::fs::read_to_string(folder.path().join("new/site").join(name)).unwrap();
    let index = read("index.html");
    for (page, rule) in [("template.html", "end/truncated"), ("template-2.html", "end/truncated")] {
        let link = index.split(&format!("href=\"{page}#")).nth(1).unwrap();
        let id = link.split('"').next().unwrap();
        let (_, article) = read(page)
            .split_once(&format!("id=\"{id}\""))
            .map(|(a, b)| (a.to_owned(), b.to_owned()))
            .unwrap();
        let heading = article.split("</h3>").next().unwrap().replace("<wbr/>", "");
        assert!(heading.contains(rule), "{page}: {heading}");
    }
    assert!(!index.contains("reference.html#"));
    let badge: serde_json::Value = serde_json::from_str(&read("template.json")).unwrap();
    assert_eq!(badge["schemaVersion"], 1);
    assert!(badge["message"].as_str().unwrap().starts_with("diverges "));
    assert!(read("template.svg").contains(badge["message"].as_str().unwrap()));
    let text = read("survey.md");
    assert!(text.contains("| rule | template | reference | template (2) |"));
    assert!(text.contains("Shown by template (") && text.contains("template (2) ("));
}

#[test]
fn a_site_that_cannot_be_written_is_an_error_before_the_run() {
    let folder = folder(&[]);
    std::fs::write(folder.path().join("taken"), "text").unwrap();
    let arguments = ["conform", "--port", "no-such-program", "--site", "taken"];
    let (_, error, status) = pogema(folder.path(), &arguments);
    assert_eq!(status, 2);
    assert!(error.contains("taken: "), "{error}");
    assert_eq!(std::fs::read_to_string(folder.path().join("taken")).unwrap(), "text");
}
