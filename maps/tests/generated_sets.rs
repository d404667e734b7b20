//! The generated map sets are the published ones, byte by byte.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_maps::formats::{read_set, write_set};
use pogema_maps::generators::Preset;
use sha2::{Digest, Sha256};

/// The published file of a preset, as its hash and its number of maps.
fn check(preset: Preset, num_maps: usize, hash: &str) {
    let maps = preset.maps().unwrap();
    assert_eq!(maps.len(), num_maps);
    let text = write_set(&maps).unwrap();
    let digits: Vec<String> = Sha256::digest(&text).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(digits.concat(), hash, "{} is not the published set", preset.name());
    assert_eq!(read_set(&text).unwrap(), maps);
}

#[test]
fn random_maps_are_the_published_ones() {
    check(Preset::ValidationRandom, 128, "49763f68b1995024d79e230141ee829ea060d4a357d1e0b0964d4cb21222c2bb");
}

#[test]
fn mazes_are_the_published_ones() {
    check(Preset::ValidationMazes, 128, "e93d3544b4211f2efe6439dcbf9e14540536dd18b8fcf83ebc14c2c0a25a25d2");
}

#[test]
fn the_warehouse_is_the_published_one() {
    check(Preset::Warehouse, 1, "f121e90c3c237d4d28e30c7a11d9923a18c6787869c2d7f53373a7545c2c0862");
}
