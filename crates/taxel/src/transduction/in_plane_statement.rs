//! What a solution of an in-plane sensor follows from, and its table taken for that drawing.

use std::fmt::Write as _;
use std::sync::Arc;

use super::in_plane_model::InPlaneModel;
use super::in_plane_table::{CONTENTS, DrawnTable};
use super::path_table::{PathTable, WrongTable};
use crate::mechanics::ElectrodeStiffness;
use crate::of_drawing::{SOLVER_VERSION, digits};

/// Raised whenever mesh, steps or numbers of the solution change.
const METHOD: u32 = 2;

impl InPlaneModel {
    /// The cross-section as `key = value`, one on each line; lengths are over the thickness of the
    /// layer.
    pub(crate) fn section_statement(&self) -> String {
        let (layer, electrodes) = (&self.layer, &self.electrodes);
        let over_layer = |length: f64| digits(length / layer.thickness);
        let stiffness = match electrodes.stiffness {
            ElectrodeStiffness::AsLayer => 1.0,
            ElectrodeStiffness::Modulus(stiff) => stiff.youngs_modulus / layer.youngs_modulus,
        };
        format!(
            "solution = cross-section of a layer with two bars\n\
             solver = taxel-fem {} method {METHOD}\n\
             material = incompressible, stresses over the shear modulus of the layer\n\
             half_length_over_thickness = {}\n\
             gap_over_thickness = {}\n\
             width_over_thickness = {}\n\
             bar_over_thickness = {}\n\
             height_over_thickness = {}\n\
             modulus_of_bars_over_layer = {}\n\
             top = {:?}\n\
             ends = {:?}\n\
             permittivity = {}\n\
             surroundings = {:?}\n",
            SOLVER_VERSION,
            over_layer(layer.contact_half_length),
            over_layer(electrodes.gap),
            over_layer(electrodes.width),
            over_layer(electrodes.thickness),
            over_layer(electrodes.height),
            digits(stiffness),
            layer.top,
            // A factor as it is: the force keeps it.
            layer.end_condition,
            digits(self.dielectric.permittivity),
            self.dielectric.surroundings,
        )
    }

    /// All that a table of its load path follows from, as `key = value`.
    pub fn path_statement(&self) -> Vec<String> {
        let (layer, electrodes) = (&self.layer, &self.electrodes);
        let mut text = self.section_statement();
        for (key, value) in [
            ("layer_thickness", layer.thickness),
            ("layer_modulus", layer.youngs_modulus),
            ("loaded_depth", layer.contact_depth),
            ("electrode_depth", electrodes.depth),
        ] {
            let _ = writeln!(text, "{key} = {}", digits(value));
        }
        text.lines().map(str::to_owned).collect()
    }

    /// Takes the text of a table of this drawing in the place of the closed forms.
    ///
    /// # Errors
    /// [`WrongTable`].
    pub fn take_table(&mut self, text: &str) -> Result<(), WrongTable> {
        let table = PathTable::read(text, &CONTENTS, &self.path_statement())?;
        let closed = self.closed_layer();
        self.table = Some(Arc::new(DrawnTable { table, closed }));
        Ok(())
    }
}
