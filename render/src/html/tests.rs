//! Tests of the pages without a browser.

use pogema_core::{Cell, Error, Outside, Trace};

use super::{editor, replay};
use crate::reverted_moves::play::play;

fn trace() -> Trace {
    play("{size: 6, num_agents: 3, density: 0.1, seed: 1, on_target: restart, max_episode_steps: 5}", 0.3)
        .unwrap()
}

fn replay_error(trace: &Trace) -> String {
    replay(trace, "t").unwrap_err().to_string()
}

#[test]
fn titles_are_escaped() {
    let page = replay(&trace(), "</title><script>alert(1)</script>&\"").unwrap();
    let title = "&lt;&#x2f;title&gt;&lt;script&gt;alert(1)&lt;&#x2f;script&gt;&amp;&quot;";
    assert!(page.contains(&format!("<title>{title}</title>")), "{}", &page[..600]);
    assert!(page.contains(&format!("<h1 id=\"title\">{title}</h1>")));
    assert_eq!(page.matches("<script").count(), 2, "the data and the page's script");
}

#[test]
fn pages_contain_no_external_addresses() {
    for page in [editor(), replay(&trace(), "t").unwrap()] {
        for address in ["http:", "https:", "//www", "@import", "url("] {
            assert!(!page.contains(address), "{address}");
        }
        assert!(page.contains("default-src 'none'"));
        assert!(!page.contains("unsafe-"));
    }
}

#[test]
fn an_episode_without_steps_is_shown() {
    let mut trace = trace();
    trace.steps.clear();
    let page = replay(&trace, "start").unwrap();
    assert!(page.contains("\"num_steps\":0,"));
}

#[test]
fn lists_of_wrong_length_are_rejected() {
    let mut short = trace();
    short.steps[2].rewards.pop();
    assert_eq!(replay(&short, "t"), Err(Error::Length { what: "rewards", want: 3, got: 2 }));
    let mut short = trace();
    short.start.state.goals.pop();
    assert_eq!(replay(&short, "t"), Err(Error::Length { what: "goals", want: 3, got: 2 }));
}

#[test]
fn cells_off_the_map_are_rejected() {
    let mut off = trace();
    off.steps[1].state.goals[2] = Cell::new(6, 0);
    assert_eq!(
        replay_error(&off),
        "a cell of frame 2 is `(6, 0)`, expected a cell of the map of 6 rows and 6 columns"
    );
}

#[test]
fn jumps_are_rejected() {
    let mut jump = trace();
    jump.start.state.cells[1] = Cell::new(0, 0);
    jump.steps[0].state.cells[1] = Cell::new(5, 5);
    assert_eq!(
        replay_error(&jump),
        "trace: line 3: agent 1 is on (5, 5), expected (0, 0) or a cell next to it"
    );
}

#[test]
fn noise_of_another_size_is_rejected() {
    let mut trace = trace();
    trace.header.outside = Outside::Noise(trace.header.map.clone());
    let got = trace.header.map.height();
    let want = got + 2 * trace.header.config.radius;
    assert_eq!(replay(&trace, "t"), Err(Error::Length { what: "noise", want, got }));
}

#[test]
fn a_mark_that_is_listed_twice_is_one_mark() {
    let trace = trace();
    let mut twice = trace.clone();
    let cell = twice.start.state.occupied[0];
    twice.start.state.occupied.push(cell);
    assert_eq!(replay(&twice, "t"), replay(&trace, "t"));
}
