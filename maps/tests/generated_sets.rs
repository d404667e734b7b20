//! The generated validation sets, the warehouse and the tiles equal the published ones, byte for byte. The training
//! sets have the published sizes and names.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_maps::formats::{NamedMap, read_set, write_set};
use pogema_maps::generators::Preset;
use pogema_maps::{PUBLISHED_TILE, tiles};
use sha2::{Digest, Sha256};

/// Compares maps with a published file, given by its number of maps and its hash.
fn check(maps: &[NamedMap], num_maps: usize, hash: &str) {
    assert_eq!(maps.len(), num_maps);
    let text = write_set(maps).unwrap();
    let digits: Vec<String> = Sha256::digest(&text).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(
        digits.concat(),
        hash,
        "the set that begins with {} differs from the published one",
        maps[0].name
    );
    assert_eq!(read_set(&text).unwrap(), maps);
}

#[test]
fn random_maps_equal_the_published_ones() {
    check(
        &Preset::ValidationRandom.maps().unwrap(),
        128,
        "49763f68b1995024d79e230141ee829ea060d4a357d1e0b0964d4cb21222c2bb",
    );
}

#[test]
fn mazes_equal_the_published_ones() {
    check(
        &Preset::ValidationMazes.maps().unwrap(),
        128,
        "e93d3544b4211f2efe6439dcbf9e14540536dd18b8fcf83ebc14c2c0a25a25d2",
    );
}

#[test]
fn the_warehouse_equals_the_published_one() {
    check(
        &Preset::Warehouse.maps().unwrap(),
        1,
        "f121e90c3c237d4d28e30c7a11d9923a18c6787869c2d7f53373a7545c2c0862",
    );
}

#[test]
fn tiles_of_city_maps_equal_the_published_ones() {
    let packed: &[u8] = include_bytes!("data/city-maps.yaml.zst");
    let text = String::from_utf8(zstd::decode_all(packed).unwrap()).unwrap();
    let cities = read_set(&text).unwrap();
    assert_eq!(cities.len(), 8);
    let cut = |city: &NamedMap| tiles(&city.name, &city.text.map, PUBLISHED_TILE).unwrap();
    let cut: Vec<NamedMap> = cities.iter().flat_map(cut).collect();
    check(&cut, 128, "3d357b87c64bab6a08a8ec43cfe81295ed37fd4a14db36d563e4ae599785664f");
}

#[test]
fn training_sets_have_the_published_names() {
    let names = |preset: Preset| {
        let maps = preset.maps().unwrap();
        (maps.len(), maps[0].name.clone(), maps[maps.len() - 1].name.clone())
    };
    let expected = |number, first: &str, last: &str| (number, first.to_owned(), last.to_owned());
    let random = expected(512, "training-random-seed-128", "training-random-seed-639");
    assert_eq!(names(Preset::TrainingRandom), random);
    let mazes = expected(2048, "training-mazes-seed-0128", "training-mazes-seed-2175");
    assert_eq!(names(Preset::TrainingMazes), mazes);
}
