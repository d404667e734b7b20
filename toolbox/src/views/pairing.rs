//! Rows of two groups, for example of two algorithms, paired by instance.

use std::collections::BTreeMap;

use crate::results::Row;

/// The rows of the instances that both groups played.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairing<'a> {
    /// The rows of both, sorted by instance.
    pub pairs: Vec<(&'a Row, &'a Row)>,
    /// Number of instances that only one group played.
    pub alone: usize,
}

impl<'a> Pairing<'a> {
    /// Pairs rows with the same key. If several rows of one group have the same key, the last one counts.
    pub fn of(
        first: impl IntoIterator<Item = &'a Row>,
        second: impl IntoIterator<Item = &'a Row>,
        key: impl Fn(&Row) -> String,
    ) -> Self {
        let mut played: BTreeMap<String, [Option<&Row>; 2]> = BTreeMap::new();
        for row in first {
            played.entry(key(row)).or_default()[0] = Some(row);
        }
        for row in second {
            played.entry(key(row)).or_default()[1] = Some(row);
        }
        let mut pairing = Self::default();
        for rows in played.into_values() {
            match rows {
                [Some(one), Some(other)] => pairing.pairs.push((one, other)),
                _ => pairing.alone += 1,
            }
        }
        pairing
    }
}
