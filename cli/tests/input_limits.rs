//! Input that never ends, or unpacks to more than fits into memory, is rejected.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use common::TRACE;

/// Runs a shell command with 2 GiB of memory in a folder, with `pogema` as `$0`.
fn within_memory(folder: &Path, command: &str) -> (String, Option<i32>) {
    let command = format!("ulimit -v 2097152; exec {command}");
    let mut shell = Command::new("sh");
    shell.args(["-c", &command, env!("CARGO_BIN_EXE_pogema")]).current_dir(folder).stdin(Stdio::null());
    let output = shell.output().unwrap();
    (String::from_utf8(output.stderr).unwrap(), output.status.code())
}

#[track_caller]
fn assert_rejected(folder: &Path, command: &str, expected: &str) {
    let (error, status) = within_memory(folder, command);
    assert_eq!((error.lines().count(), status), (1, Some(2)), "{command}: {error}");
    assert!(error.contains(expected), "{command}: {error}");
}

#[test]
fn endless_input_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("row.txt"), "aA..\n").unwrap();
    let line = "the line is longer than the input limit of 256 MiB";
    let short_line = "the line is longer than the input limit of 1 MiB";
    assert_rejected(at, r#""$0" render /dev/zero"#, line);
    assert_rejected(at, r#""$0" port --input-limit 1 </dev/zero"#, short_line);
    assert_rejected(at, r#""$0" conform --trace /dev/zero --input-limit 1"#, short_line);
    assert_rejected(at, r#""$0" conform --port true --case /dev/zero"#, line);
    assert_rejected(
        at,
        r#""$0" run --map row.txt --policy file --actions /dev/zero --input-limit 1"#,
        short_line,
    );
    let file = "the input is larger than 4 MiB, 4 times the input limit of 1 MiB";
    assert_rejected(at, r#""$0" validate /dev/zero --map row.txt --input-limit 1"#, file);
    assert_rejected(at, r#""$0" maps show /dev/zero"#, "larger than 256 MiB, the maximum");
    assert_rejected(at, r#""$0" run /dev/zero"#, "larger than 256 MiB");
    assert_rejected(at, r#""$0" views . --config /dev/zero"#, "larger than 256 MiB");
    fs::create_dir(at.join("results")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", at.join("results/Random.json")).unwrap();
    fs::write(at.join("views.yaml"), "results_views:\n  all: {type: tabular}\n").unwrap();
    assert_rejected(
        at,
        r#""$0" views results --config views.yaml"#,
        "results/Random.json: the file is larger than 512 MiB",
    );
}

#[test]
fn compressed_zeros_and_blank_lines_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, parts: &[(&[u8], usize)]| {
        let mut packed = zstd::Encoder::new(File::create(folder.path().join(name)).unwrap(), 1).unwrap();
        for (part, times) in parts {
            (0..*times).for_each(|_| std::io::Write::write_all(&mut packed, part).unwrap());
        }
        packed.finish().unwrap();
    };
    let zeros = vec![0; 1 << 20];
    write("zeros.jsonl.zst", &[(&zeros, 300)]);
    write("later.jsonl.zst", &[(TRACE.as_bytes(), 1), (&zeros, 3)]);
    let blank = vec![b'\n'; 1 << 20];
    write("blank.jsonl.zst", &[(TRACE.as_bytes(), 1), (&blank, 5)]);
    write("long.jsonl.zst", &[(TRACE.as_bytes(), 1), (&blank, 3)]);
    let at = folder.path();
    let line = "the line is longer than the input limit of";
    assert_rejected(at, r#""$0" render zeros.jsonl.zst"#, &format!("{line} 256 MiB"));
    assert_rejected(
        at,
        r#""$0" render later.jsonl.zst --input-limit 2"#,
        &format!("trace: line 3: {line} 2 MiB"),
    );
    let file = "the input is larger than 4 MiB, 4 times the input limit of 1 MiB";
    assert_rejected(at, r#""$0" render blank.jsonl.zst --input-limit 1"#, file);
    assert_rejected(at, r#""$0" conform --trace blank.jsonl.zst --input-limit 1"#, file);
    let (error, status) = within_memory(at, r#""$0" conform --input-limit 1"#);
    assert!(error.contains("--trace <FILE>") && status == Some(2), "{error}");
    let (error, status) = within_memory(at, r#""$0" render long.jsonl.zst --input-limit 1"#);
    assert_eq!((error.as_str(), status), ("", Some(0)));
}
