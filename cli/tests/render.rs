//! Tests of `pogema render` and of the pictures of `pogema run`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::path::Path;
use std::process::Output;

const RUN: &str = "run --size 6 --num-agents 3 --seed 1 --steps 12 --on-target restart";
const KINDS: [(&str, &[u8]); 3] = [("a.svg", b"<svg"), ("a.png", b"\x89PNG"), ("a.gif", b"GIF89a")];

/// Runs the program in a folder, with `path` as the only folder on the PATH.
fn pogema(folder: &Path, path: &Path, arguments: &str) -> Output {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    program::command(folder, &arguments).env("PATH", path).output().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn run_and_render_draw_the_same() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let trace = second.path().join("t.jsonl.zst");
    let flags = "--egocentric 1 --border full --fps 10 --width 90 --colors #ff0000,#00ff00";
    let flags = format!("--svg a.svg --png a.png --gif a.gif {flags}");
    let output = pogema(first.path(), first.path(), &format!("{RUN} --trace {} {flags}", trace.display()));
    assert!(output.status.success(), "{output:?}");
    let output = pogema(second.path(), second.path(), &format!("render t.jsonl.zst {flags}"));
    assert_eq!((output.status.code(), output.stdout.len(), output.stderr.len()), (Some(0), 0, 0));
    for (name, begin) in KINDS {
        let [one, other] = [&first, &second].map(|folder| std::fs::read(folder.path().join(name)).unwrap());
        assert!(one == other && one.starts_with(begin), "{name}");
    }
    assert_eq!(names(first.path()), ["a.gif", "a.png", "a.svg"]);
}

#[test]
fn without_a_file_the_episode_is_played_as_text() {
    let folder = tempfile::tempdir().unwrap();
    let stdout_of = |arguments: &str| {
        let output = pogema(folder.path(), folder.path(), arguments);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let run = stdout_of(&format!("{RUN} --render --trace t.jsonl"));
    let played = stdout_of("render t.jsonl");
    assert_eq!(run.rsplit_once("\n12 steps").unwrap().0, played.trim_end());
    assert_eq!(played.matches("step ").count(), 13);
    let part = stdout_of("render t.jsonl --steps 4..6 --svg a.svg --text");
    assert!(played.contains(part.trim_end()) && part.starts_with("step 4\n") && part.contains("step 6\n"));
    let frame = stdout_of("render t.jsonl --frame 5");
    assert!(frame.starts_with("step 5\n") && frame.matches("step").count() == 1 && played.contains(&frame));
    let view = stdout_of("render t.jsonl --frame 5 --view 2 --border none");
    assert!(view.contains('c') && !view.contains('A') && !view.contains('│'));
}

#[cfg(unix)]
mod videos {
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    use super::{RUN, names, pogema};

    /// Returns two folders: one for programs, which holds `ffmpeg` if given, and one with a trace.
    fn folders(ffmpeg: Option<&str>) -> [tempfile::TempDir; 2] {
        let [programs, work] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        if let Some(script) = ffmpeg {
            let path = programs.path().join("ffmpeg");
            std::fs::write(&path, format!("#!/bin/sh\nPATH=/usr/bin:/bin\n{script}")).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        }
        assert!(pogema(work.path(), programs.path(), &format!("{RUN} --trace t.jsonl")).status.success());
        [programs, work]
    }

    fn error_of(folder: &Path, programs: &Path, arguments: &str) -> String {
        let output = pogema(folder, programs, arguments);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{output:?}");
        String::from_utf8(output.stderr).unwrap().trim_end().to_owned()
    }

    #[test]
    fn ffmpeg_gets_every_frame_and_the_file_appears_at_the_end() {
        // A stand-in that writes its arguments and the size of its input.
        let script = r#"[ "$1" = -version ] && exit; for last; do :; done; (echo "$*"; wc -c) > "$last""#;
        let [programs, work] = folders(Some(script));
        for (name, codec) in [("a.mp4", "libx264"), ("b.webm", "libvpx-vp9")] {
            let arguments = format!("render t.jsonl --video {name} --width 61 --fps 10");
            let output = pogema(work.path(), programs.path(), &arguments);
            assert!(output.status.success(), "{output:?}");
            let text = std::fs::read_to_string(work.path().join(name)).unwrap();
            let (arguments, size) = text.split_once('\n').unwrap();
            assert!(
                arguments.contains("-pix_fmt rgba -video_size 62x62 -framerate 30.0000 -i -"),
                "{arguments}"
            );
            assert!(arguments.contains(codec), "{arguments}");
            // 12 steps, plus one for the first state and one for the last state. Each step has three frames.
            assert_eq!(size.trim().parse::<usize>().unwrap(), 14 * 3 * 62 * 62 * 4);
        }
        assert_eq!(names(work.path()), ["a.mp4", "b.webm", "t.jsonl"]);
    }

    #[test]
    fn a_failing_ffmpeg_is_quoted_and_the_old_file_stays() {
        let script = r#"[ "$1" = -version ] && exit; for last; do :; done; echo half > "$last"
            echo first >&2; echo "Unknown encoder 'libx264'" >&2; exit 3"#;
        let [programs, work] = folders(Some(script));
        std::fs::write(work.path().join("a.mp4"), "before").unwrap();
        let error = error_of(work.path(), programs.path(), "render t.jsonl --video a.mp4");
        assert_eq!(error, "error: a.mp4: ffmpeg failed (exit status: 3): Unknown encoder 'libx264'");
        assert_eq!(std::fs::read_to_string(work.path().join("a.mp4")).unwrap(), "before");
        assert_eq!(names(work.path()), ["a.mp4", "t.jsonl"]);
    }

    #[test]
    fn an_ffmpeg_that_cannot_run_is_rejected_before_play() {
        let [programs, work] = folders(Some("exit 127"));
        let play = "run --map four-rooms --num-agents 2 --policy random --steps 2 --video a.mp4";
        let error = error_of(work.path(), programs.path(), play);
        assert_eq!(error, "error: ffmpeg: `-version` failed (exit status: 127)");
        assert_eq!(names(work.path()), ["t.jsonl"]);
    }

    #[test]
    fn an_ffmpeg_that_writes_nothing_is_an_error() {
        let [programs, work] = folders(Some("cat > /dev/null"));
        let error = error_of(work.path(), programs.path(), "render t.jsonl --video a.mp4");
        assert_eq!(error, "error: a.mp4: ffmpeg wrote nothing");
        assert_eq!(names(work.path()), ["t.jsonl"]);
    }

    #[test]
    fn without_ffmpeg_no_episode_is_played() {
        let [programs, work] = folders(None);
        for arguments in ["render t.jsonl --video a.mp4", "run --trace b.jsonl --video a.mp4"] {
            let error = error_of(work.path(), programs.path(), arguments);
            let begin = "error: videos need the program `ffmpeg`, which is not on the PATH: install it";
            assert!(error.starts_with(begin) && error.lines().count() == 1, "{error}");
        }
        assert_eq!(names(work.path()), ["t.jsonl"]);
    }
}
