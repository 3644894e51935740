//! Evaluation of many designs: on all cores, in the order asked, with what is kept.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use taxel::sensor::Sensor;

use crate::file::AfterFile;
use crate::store::{Kept, Store, StoreError, key_of};
use crate::study::{Row, Study};

/// Evaluates designs of a study.
pub struct Runner<'a> {
    /// The study.
    pub study: &'a Study,
    /// Where finished designs are kept.
    pub store: Option<Store>,
    /// True when the user wants to stop: designs in work are finished, but for sections of
    /// microchannels, which are given up before the next pressure.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Hears the number of designs that were finished since the runner was made.
    pub progress: &'a (dyn Fn(usize) + Sync),
    /// Designs that were computed, not found.
    pub computed: usize,
    /// Who computes designs in the place of this process, and keeps them in the store.
    pub elsewhere: Option<&'a Elsewhere<'a>>,
    /// What the designs are made devices of; none for designs themselves.
    pub made: Option<Made>,
}

/// The drawing of made devices, and what is corrected on each.
pub struct Made {
    /// The drawing, if it can be read.
    pub drawn: Option<Sensor>,
    /// What is corrected.
    pub after: AfterFile,
    /// Key of the drawing.
    pub of: String,
}

/// Computes designs in other processes: their rows in the order asked, none for those that were
/// not begun before a stop.
pub type Elsewhere<'a> = dyn Fn(&[Vec<f64>]) -> Result<Vec<Option<Row>>, StoreError> + 'a;

/// Designs between two looks at the store where there is none.
const WITHOUT_STORE: usize = 4096;

impl<'a> Runner<'a> {
    /// A runner that keeps nothing and cannot be stopped.
    pub fn new(study: &'a Study) -> Self {
        Self {
            study,
            store: None,
            stop: &|| false,
            progress: &|_| {},
            computed: 0,
            elsewhere: None,
            made: None,
        }
    }

    /// The rows of `points`, in their order; none for those that were not begun before a stop.
    ///
    /// # Errors
    /// When the store cannot be written.
    pub fn rows(&mut self, points: &[Vec<f64>]) -> Result<Vec<Option<Row>>, StoreError> {
        self.some_rows(points, &|_| true)
    }

    /// The same for the blocks whose number `wanted` accepts; of the others what is kept.
    ///
    /// # Errors
    /// When the store cannot be written.
    pub fn some_rows(
        &mut self,
        points: &[Vec<f64>],
        wanted: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<Option<Row>>, StoreError> {
        let size = match &self.store {
            Some(store) if self.elsewhere.is_none() => store.block,
            _ => WITHOUT_STORE,
        };
        let mut rows = Vec::with_capacity(points.len());
        for (number, block) in points.chunks(size).enumerate() {
            rows.extend(self.block(block, wanted(number))?);
        }
        Ok(rows)
    }

    fn block(
        &mut self,
        points: &[Vec<f64>],
        compute: bool,
    ) -> Result<Vec<Option<Row>>, StoreError> {
        let study = self.study;
        let keys: Option<Vec<String>> = self.store.as_ref().map(|_| {
            // All that the result of a design follows from.
            let made = self.made.as_ref().map_or_else(String::new, |made| {
                format!("\nmade of {}, after {:?}", made.of, made.after)
            });
            let key = |point: &Vec<f64>| key_of(&(study.content(point) + &made));
            points.par_iter().map(key).collect()
        });
        let kept = |index: usize| {
            let (store, keys) = self.store.as_ref().zip(keys.as_ref())?;
            let kept = store.kept(&keys[index])?.clone();
            let (_, point) = study.text_of(&points[index]);
            Some(Row {
                point,
                status: kept.status,
                reason: kept.reason,
                answers: kept.answers,
            })
        };
        let mut rows: Vec<Option<Row>> = (0..points.len()).map(kept).collect();
        let missing: Vec<usize> = (0..points.len())
            .filter(|index| rows[*index].is_none())
            .collect();
        if !compute || missing.is_empty() {
            return Ok(rows);
        }
        // One design alone is not sooner done elsewhere, and a search of one after the other would
        // wait for each.
        if let Some(elsewhere) = self.elsewhere
            && missing.len() > 1
        {
            let points: Vec<_> = missing.iter().map(|index| points[*index].clone()).collect();
            for (index, row) in missing.into_iter().zip(elsewhere(&points)?) {
                self.computed += usize::from(row.is_some());
                rows[index] = row;
            }
            (self.progress)(self.computed);
            return Ok(rows);
        }
        let (stop, progress, made) = (self.stop, self.progress, &self.made);
        let made = made.as_ref().map(|made| (made.drawn.as_ref(), made.after));
        let finished = AtomicUsize::new(self.computed);
        let alike = alike(study, points, &missing);
        let computed: Vec<Vec<Option<Row>>> = alike
            .par_iter()
            .map(|group| {
                if stop() {
                    return vec![None; group.len()];
                }
                let drawn = made.and_then(|(drawn, after)| Some((drawn?, after)));
                let group: Vec<&[f64]> = group.iter().map(|at| points[*at].as_slice()).collect();
                let rows = study.evaluate_alike(&group, drawn, &stop);
                let made = rows.iter().flatten().count();
                progress(finished.fetch_add(made, Ordering::Relaxed) + made);
                rows
            })
            .collect();
        let computed = computed.into_iter().flatten();
        let mut to_keep = Vec::new();
        for (index, row) in missing.into_iter().zip(computed) {
            let Some(row) = row else { continue };
            self.computed += 1;
            if let Some(keys) = &keys {
                let kept = Kept {
                    status: row.status,
                    reason: row.reason.clone(),
                    answers: row.answers.clone(),
                };
                to_keep.push((keys[index].clone(), kept));
            }
            rows[index] = Some(row);
        }
        if let Some(store) = &mut self.store {
            store.keep(to_keep)?;
        }
        Ok(rows)
    }
}

/// Neighbours among `missing` that are the same sensor under different conditions.
fn alike(study: &Study, points: &[Vec<f64>], missing: &[usize]) -> Vec<Vec<usize>> {
    if !study.has_conditions() {
        return missing.iter().map(|index| vec![*index]).collect();
    }
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut last = String::new();
    for index in missing {
        let (text, _) = study.text_of(&points[*index]);
        match groups.last_mut() {
            Some(group) if text == last => group.push(*index),
            _ => groups.push(vec![*index]),
        }
        last = text;
    }
    groups
}
