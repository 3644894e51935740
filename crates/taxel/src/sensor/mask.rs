//! Taxels, capacitors and channels that are known not to work.

use schemars::JsonSchema;
use serde::Deserialize;

/// One taxel, one of its capacitors, or one channel of a trained array that is not used.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mask {
    /// Row and column of the taxel, from 0.
    pub taxel: Option<[usize; 2]>,
    /// `"11"`, `"12"`, `"21"` or `"22"`; without it the whole taxel is masked.
    pub capacitor: Option<CapacitorName>,
    /// Group and name of a channel of a trained array, such as `"chip 1 x"`.
    pub channel: Option<String>,
}

/// Name of one capacitor of a unit: row i = 1 is +y, column j = 1 is -x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum CapacitorName {
    /// +y, -x.
    #[serde(rename = "11")]
    C11,
    /// +y, +x.
    #[serde(rename = "12")]
    C12,
    /// -y, -x.
    #[serde(rename = "21")]
    C21,
    /// -y, +x.
    #[serde(rename = "22")]
    C22,
}

/// Masked capacitors of every taxel; entries outside the array are ignored.
pub(crate) fn table(masks: &[Mask], rows: usize, columns: usize) -> Vec<[bool; 4]> {
    let mut table = vec![[false; 4]; rows * columns];
    for mask in masks {
        let Some([row, column]) = mask.taxel else {
            continue;
        };
        if row < rows && column < columns {
            let taxel = &mut table[row * columns + column];
            match mask.capacitor {
                Some(capacitor) => taxel[capacitor as usize] = true,
                None => *taxel = [true; 4],
            }
        }
    }
    table
}
