//! Encoders reject wrong settings and calls with an error of one line, and change nothing.

use std::sync::atomic::AtomicBool;

use pogema_core::{Cell, Error, Map, Occupancy, Outside, State};
use pogema_policies::{Channel, Encoder, EncoderSettings};

const CELLS: [Cell; 2] = [Cell::new(0, 0), Cell::new(1, 1)];

fn state<'a>(cells: &'a [Cell], goals: &'a [Cell]) -> State<'a> {
    State { step: 0, cells, goals, active: &[true, true], on_goal: &[false, false] }
}

#[test]
fn settings_out_of_range_are_rejected() {
    let message = |radius, sight, count| {
        let channels = vec![Channel::Goal; count];
        Encoder::new(EncoderSettings { sight, ..EncoderSettings::new(radius, channels) })
            .unwrap_err()
            .to_string()
    };
    assert_eq!(message(0, 5, 1), "config: `radius` is `0`, expected 1 to 128");
    assert_eq!(message(5, 129, 1), "config: `sight` is `129`, expected 1 to 128");
    assert_eq!(message(5, 5, 65), "config: `channels` is `a list of 65`, expected at most 64");
    let error =
        serde_json::from_str::<EncoderSettings>(r#"{"radius": 3, "channels": ["walls"]}"#).unwrap_err();
    assert!(error.to_string().contains("walls"), "{error}");
    let text = r#"{"radius": 3, "channels": [], "side": 7}"#;
    let error = serde_json::from_str::<EncoderSettings>(text).unwrap_err();
    assert!(error.to_string().contains("unknown field `side`"), "{error}");
}

#[test]
fn wrong_calls_change_nothing() -> Result<(), Error> {
    let map = Map::from_rows(&["..", ".."])?;
    let settings = EncoderSettings::new(1, [Channel::Agents, Channel::CostTracer]);
    let (mut encoder, mut other) = (Encoder::new(settings.clone())?, Encoder::new(settings)?);
    let (mut out, mut expected) = ([7.0; 36], [0.0; 36]);
    assert_eq!(encoder.encode(state(&CELLS, &CELLS), &mut out, &mut []), Err(Error::NotReset));
    encoder.begin(&map, &Outside::Free, Occupancy::default(), &CELLS);
    let mut message = |cells: &[Cell], goals: &[Cell], len: usize, scalars: usize| {
        let error = encoder.encode(state(cells, goals), &mut out[..len], &mut [0.0; 4][..scalars]);
        error.unwrap_err().to_string()
    };
    let beyond = [Cell::new(0, 0), Cell::new(0, 2)];
    assert_eq!(message(&CELLS[..1], &CELLS, 36, 0), "cells has length 1, expected 2");
    assert_eq!(message(&CELLS, &CELLS, 35, 0), "windows has length 35, expected 36");
    assert_eq!(message(&CELLS, &CELLS, 36, 1), "scalars has length 1, expected 0");
    let outside = "instance: agent 1: goal (0, 2) is outside the map of 2 rows and 2 columns";
    assert_eq!(message(&CELLS, &beyond, 36, 0), outside);
    assert_eq!(message(&beyond, &CELLS, 36, 0), outside.replace("goal", "cell"));
    let write = |encoder: &mut Encoder, out: &mut [f32], step: u64| {
        let state = State { step, ..state(&CELLS, &CELLS) };
        encoder.write(state, out, &mut []).unwrap_err().to_string()
    };
    let unknown = "found the state of step 0, expected an earlier call of `follow`";
    assert_eq!(write(&mut encoder, &mut out, 0), unknown);
    assert_eq!(encoder.follow_until(state(&CELLS, &CELLS), &AtomicBool::new(true)), Err(Error::Cancelled));
    assert_eq!(write(&mut encoder, &mut out, 0), unknown);
    encoder.begin(&map, &Outside::Free, Occupancy::default(), &CELLS);
    encoder.follow(state(&CELLS, &CELLS))?;
    let next = "found the state of step 1, expected that of step 0, which was followed last";
    assert_eq!(write(&mut encoder, &mut out, 1), next);
    assert_eq!(out, [7.0; 36]);
    encoder.begin(&map, &Outside::Free, Occupancy::default(), &CELLS);
    encoder.encode(state(&CELLS, &CELLS), &mut out, &mut [])?;
    other.begin(&map, &Outside::Free, Occupancy::default(), &CELLS);
    other.encode(state(&CELLS, &CELLS), &mut expected, &mut [])?;
    assert_eq!(out, expected);
    Ok(())
}
