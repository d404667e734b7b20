//! Tests of `pogema conform --port` with unwritable report files and invalid lists of known deviations.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use program::assert_rejected;

/// Returns a folder with an empty list of known deviations.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("known.yaml"), "[]").unwrap();
    folder
}

#[test]
fn invalid_lists_of_known_deviations_are_rejected_with_one_line() {
    let entry = |text: &str| {
        let (at, text) = text.split_once(": ").unwrap();
        let all = [("rule", "collide/soft"), ("what", "cell"), ("since", "2026-11-22"), ("reason", "r")];
        let lines = all.map(|(name, value)| format!("{name}: {}", if name == at { text } else { value }));
        let more =
            if all.iter().any(|(name, _)| *name == at) { String::new() } else { format!(", {at}: {text}") };
        format!("- {{{}{more}}}\n", lines.join(", "))
    };
    let good = entry("reason: r");
    let date = |text: &str| format!("entry 1: `since` is `{text}`, expected a date such as 2026-11-22");
    let rejected = [
        (
            good.clone() + &entry("until: 2027"),
            "entry 2: unknown field `until`, expected one of `rule`, `what`, `when`, `since`, `reason`, `port`".into(),
        ),
        ("- {rule: end/after, what: cell, since: 2026-11-22}".into(), "entry 1: missing field `reason`".into()),
        ("- {what: cell, since: 2026-11-22, reason: r}".into(), "entry 1: missing field `rule`".into()),
        (
            "- {rule: end/after, rule: end/after}".into(),
            "line 1, column 21: duplicate key `rule`".into(),
        ),
        (
            entry("rule: colide/soft"),
            "entry 1: unknown rule `colide/soft`; did you mean `collide/soft`?".into(),
        ),
        (entry("since: 2026-02-30"), date("2026-02-30")),
        (entry("since: 20261122"), date("20261122")),
        (entry("since: 2026-11-22T10:00"), date("2026-11-22T10:00")),
        (entry("reason: '  '"), "entry 1: `reason` is empty".into()),
        (good.clone() + &good, "entry 2: duplicates entry 1".into()),
        ("rule: end/after".into(), "expected a list of entries".into()),
        (
            "- end/after".into(),
            "entry 1: invalid type: string \"end/after\", expected fields and values such as `rule: collide/soft`"
                .into(),
        ),
        ("- [\n".into(), "line 1, column 3: unclosed bracket '['".into()),
    ];
    let folder = folder();
    for (text, expected) in rejected {
        std::fs::write(folder.path().join("known.yaml"), &text).unwrap();
        let arguments = ["conform", "--port", "a", "--known", "known.yaml", "--html", "report.html"];
        assert_rejected(folder.path(), &arguments, &format!("known.yaml: {expected}"));
    }
}

#[test]
fn unwritable_reports_are_rejected_before_the_run() {
    let folder = folder();
    let missing = "No such file or directory (os error 2)";
    for (arguments, expected) in [
        ("--port a --port b --badge badge.svg", "`--badge` needs exactly one port".into()),
        ("--port a --html no/report.html", format!("no/report.html: `no`: {missing}")),
        ("--port a --junit known.yaml/x", "known.yaml/x: `known.yaml` is not a folder".into()),
        ("--port a --badge ./", "./: is not a regular file".into()),
        (
            "--port a --html report.html --junit ./report.html",
            "`--junit` and `--html` name the same file, `report.html`".into(),
        ),
        ("--port a --known no.yaml", format!("no.yaml: {missing}")),
        ("--port a --keep known.yaml/x", "known.yaml/x: `known.yaml` is not a folder".into()),
        (
            "--port a --known known.yaml --junit ./known.yaml",
            "`--junit` would overwrite `./known.yaml`, which the command reads".into(),
        ),
        (
            "--port a --site . --html index.html",
            "index.html: `--html` is in the folder of `--site`, expected another folder".into(),
        ),
        (
            "--port a --oracle",
            "the argument '--port <COMMAND>' cannot be used with '--oracle'\n\nUsage: pogema conform --port <COMMAND>"
                .into(),
        ),
        (
            "--html report.html",
            "the following required arguments were not provided:\n  --port <COMMAND>\n\nUsage: pogema conform --port \
             <COMMAND> --html <FILE>"
                .into(),
        ),
    ] {
        let arguments: Vec<&str> = ["conform"].into_iter().chain(arguments.split(' ')).collect();
        assert_rejected(folder.path(), &arguments, &expected);
    }
}
