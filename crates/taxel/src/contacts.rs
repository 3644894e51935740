//! Contacts of a simulator of robots to loads on taxels.
//!
//! An engine knows points and forces of rigid contact; a soft cover spreads them. The total force is
//! kept: what lies on no taxel is given beside.

use crate::device::{Device, ElementCover};
use crate::layout::{Layout, Mount, TaxelFrame};
use crate::mechanics::{Base, ContactPressure, ShareTable, ShearTable, SoftCover};
use crate::sensor::{Sensor, Unreadable};

/// A contact of one instant, in the sensor's frame ([`TaxelFrame`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointContact {
    /// Where, m.
    pub point: [f64; 3],
    /// Force on the sensor, N; one that presses a flat sensor points along -z.
    pub force: [f64; 3],
}

/// Loads of the contacts of one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactLoads {
    /// Force on each taxel in its own frame, row by row, N: along x, along y, pressing.
    pub taxels: Vec<[f64; 3]>,
    /// Force that lies on no taxel, in the sensor's frame, N.
    pub beside: [f64; 3],
}

/// Spreads contacts over the taxels of one sensor.
///
/// # Example: a point above one element lights its neighbours
/// ```
/// use taxel::contacts::{ContactSpread, PointContact};
/// use taxel::sensor::Sensor;
///
/// let sensor = Sensor::shipped("piezo-1.5mm").unwrap();
/// let spread = ContactSpread::new(&sensor, 0.0)?;
/// let [x, y] = sensor.layout().flat_position(1);
/// let contact = PointContact { point: [x, y, 0.0], force: [0.0, 0.0, -1.0] };
/// let loads = spread.loads(&[contact]);
/// // p3_layer_transmission.csv: 0.905 on the element, 0.00227 on those 4 mm away.
/// assert!((loads.taxels[1][2] - 0.905).abs() < 1e-3);
/// assert!((loads.taxels[0][2] - 0.00227).abs() < 2e-4);
/// let total: f64 = loads.taxels.iter().map(|load| load[2]).sum();
/// assert!((total - loads.beside[2] - 1.0).abs() < 1e-12);
/// # Ok::<(), taxel::sensor::Unreadable>(())
/// ```
#[derive(Debug, Clone)]
pub struct ContactSpread {
    layout: Layout,
    cover: Option<Cover>,
}

/// Tables of the shares of a contact.
#[derive(Debug, Clone)]
struct Cover {
    side: f64,
    pressing: ShareTable,
    shear: ShearTable,
}

impl Sensor {
    /// Loads on the taxels of contacts that an engine reports for one instant, each a point, m,
    /// and the force on the sensor there, N, both in the sensor's frame; `radius` is that of the
    /// pressed disc of each contact, m, 0 for a point.
    ///
    /// [`ContactSpread`] is faster for many instants.
    ///
    /// # Errors
    /// As [`ContactSpread::new`].
    pub fn loads_from_contacts(
        &self,
        contacts: &[PointContact],
        radius: f64,
    ) -> Result<ContactLoads, Unreadable> {
        Ok(ContactSpread::new(self, radius)?.loads(contacts))
    }
}

impl ContactSpread {
    /// The spread of contacts whose pressed disc has `radius`, m, 0 for a point: by the cover of a
    /// piezoelectric array (P3 section 7), and of all others onto the taxel in whose cell the
    /// contact lies.
    ///
    /// # Errors
    /// [`Unreadable`] for a sensor that was not read from a file.
    pub fn new(sensor: &Sensor, radius: f64) -> Result<Self, Unreadable> {
        let device: &dyn Device = &*sensor.device()?;
        let contact = if radius > 0.0 {
            ContactPressure::Uniform(radius)
        } else {
            ContactPressure::Point
        };
        let tables = |cover: ElementCover| {
            let spread = SoftCover {
                thickness: cover.thickness,
                base: Base::Rigid,
                contact,
            };
            Cover {
                side: cover.side,
                pressing: spread.table(),
                shear: spread.shear_table(),
            }
        };
        Ok(Self {
            layout: sensor.layout(),
            cover: device.cover().map(tables),
        })
    }

    /// The layout of the taxels.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Loads of the contacts of one instant; the forces of the taxels, turned into the sensor's
    /// frame, and the force beside them add up to those of the contacts.
    pub fn loads(&self, contacts: &[PointContact]) -> ContactLoads {
        let mut loads = ContactLoads {
            taxels: vec![[0.0; 3]; self.layout.taxels()],
            beside: [0.0; 3],
        };
        for contact in contacts {
            let place = self.developed(contact.point);
            for axis in 0..3 {
                loads.beside[axis] += contact.force[axis];
            }
            match &self.cover {
                None => {
                    if let Some(taxel) = self.cell_of(place) {
                        let own = in_frame(&self.layout.frames[taxel], contact.force);
                        self.give(&mut loads, taxel, own);
                    }
                }
                Some(cover) => self.spread(cover, place, contact.force, &mut loads),
            }
        }
        loads
    }

    /// Shares of a contact for all elements.
    fn spread(&self, cover: &Cover, place: [f64; 2], force: [f64; 3], loads: &mut ContactLoads) {
        for taxel in 0..self.layout.taxels() {
            let [x, y] = self.layout.flat_position(taxel);
            let offset = [x - place[0], y - place[1]];
            let [along_x, along_y, pressing] = in_frame(&self.layout.frames[taxel], force);
            let share = cover.pressing.share(offset, cover.side);
            let tipped = cover.shear.shares(offset, cover.side);
            let load = [
                share * along_x,
                share * along_y,
                share * pressing + tipped[0] * along_x + tipped[1] * along_y,
            ];
            self.give(loads, taxel, load);
        }
    }

    /// Moves a load from beside onto a taxel.
    fn give(&self, loads: &mut ContactLoads, taxel: usize, load: [f64; 3]) {
        let [x, y, pressing] = self.layout.wrench(taxel, load).force;
        for (beside, taken) in loads.beside.iter_mut().zip([x, y, -pressing]) {
            *beside -= taken;
        }
        for (sum, part) in loads.taxels[taxel].iter_mut().zip(load) {
            *sum += part;
        }
    }

    /// A point on the unrolled surface, m.
    fn developed(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        match self.layout.mount {
            Mount::Flat => [x, y],
            Mount::Cylinder(cylinder) => {
                let angle = x.atan2(z + cylinder.radius);
                [cylinder.radius * angle, y]
            }
        }
    }

    /// The taxel in whose cell a place of the unrolled surface lies.
    fn cell_of(&self, place: [f64; 2]) -> Option<usize> {
        let layout = &self.layout;
        let [left, top] = layout.flat_position(0);
        let column = ((place[0] - left) / layout.pitch[0]).round();
        let row = ((top - place[1]) / layout.pitch[1]).round();
        let inside = (0.0..layout.columns as f64).contains(&column)
            && (0.0..layout.rows as f64).contains(&row);
        inside.then(|| row as usize * layout.columns + column as usize)
    }
}

/// A force of the sensor's frame in that of a taxel: along x, along y, pressing.
fn in_frame(frame: &TaxelFrame, force: [f64; 3]) -> [f64; 3] {
    let along = |axis: [f64; 3]| -> f64 { axis.iter().zip(force).map(|(a, f)| a * f).sum() };
    [
        along(frame.along_x),
        along(frame.along_y),
        -along(frame.normal),
    ]
}
