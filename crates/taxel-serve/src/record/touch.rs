//! What the estimator and the pump say, as messages of a recording.

use taxel::estimation::{Contact, Rest, Touch, TouchSession};
use taxel_recording::mcap::{
    CertaintyMessage, ContactMessage, EventMessage, RestKind, RestMessage, TouchMessage,
};

use crate::events::EventRecord;

/// Touch of a device whose values have so many components.
pub(crate) fn touch_message(touch: &Touch, components: usize) -> TouchMessage {
    let taxels = &touch.taxels;
    let first = 3 - components.clamp(1, 3);
    let mut values = Vec::with_capacity(taxels.len() * components);
    let mut deviations = Vec::with_capacity(taxels.len() * components);
    for taxel in taxels {
        values.extend(taxel.value[first..].iter().map(|value| *value as f32));
        let deviation = taxel.deviation();
        deviations.extend(deviation[first..].iter().map(|value| *value as f32));
    }
    let (centre, covariance) = touch
        .centre_of_pressure
        .unwrap_or(([f64::NAN; 2], [f64::NAN; 3]));
    TouchMessage {
        sequence: touch.sequence,
        device_time_ns: touch.time_ns,
        components: components as u8,
        values,
        deviations,
        residuals: taxels.iter().map(|taxel| taxel.residual as f32).collect(),
        states: taxels.iter().map(|taxel| taxel.state as u8).collect(),
        counted: taxels.iter().map(|taxel| u8::from(taxel.counted)).collect(),
        channel_states: touch
            .channels
            .states
            .iter()
            .map(|state| *state as u8)
            .collect(),
        force: touch.total.force,
        force_deviation: touch.total_deviation(),
        moment: touch.total.moment,
        sum: touch.sum,
        centre_of_pressure: centre,
        centre_covariance: covariance,
        left_out: touch.left_out as u32,
        clipped: touch.clipped as u32,
        merged: touch.merged as u32,
        history_uncertain: touch.history_uncertain,
        contacts: touch.contacts.iter().map(contact_message).collect(),
        certainty: Some(CertaintyMessage {
            zero_known: touch.zero_known,
            total: touch.total_certainty as u8,
            reason: touch.total_reason.map(|state| state as u8),
            contacts: touch
                .contacts
                .iter()
                .map(|contact| contact.certainty as u8)
                .collect(),
        }),
    }
}

fn contact_message(contact: &Contact) -> ContactMessage {
    ContactMessage {
        id: contact.id,
        taxels: contact.taxels as u32,
        area: contact.area,
        centre: contact.centre,
        covariance: contact.covariance,
        force: contact.force,
        force_deviation: [0, 1, 2].map(|axis| contact.force_covariance[axis][axis].sqrt()),
        torsion: contact.torsion,
        peak: contact.peak,
        peak_taxel: contact.peak_taxel as u32,
        bound: contact.bound.map(|state| state as u8),
        velocity: contact.velocity,
    }
}

pub(crate) fn event_message(record: &EventRecord) -> EventMessage {
    EventMessage {
        index: record.index,
        device_time_ns: record.time_ns,
        contact: record.contact,
        kind: record.kind.to_owned(),
        value: record.value,
        deviation: record.deviation,
        unit: record.unit.to_owned(),
        parent: record.parent,
        into: record.into,
        rise_time: record.rise_time_s,
        symmetry: record.symmetry,
        direction: record.direction,
        score: record.score,
        certainty: record.certainty.map(str::to_owned),
    }
}

/// The rest values in force, with what has happened.
pub(crate) fn rest_message(
    kind: RestKind,
    by: &str,
    device_time_ns: Option<u64>,
    session: &TouchSession,
) -> RestMessage {
    let rest = session.rest();
    RestMessage {
        device_time_ns,
        kind,
        by: by.to_owned(),
        values: rest.values().to_vec(),
        captured: rest.captured().to_vec(),
        at_end: rest.at_end().to_vec(),
        ..RestMessage::default()
    }
}

/// The rest values of a message; `None` if it has no whole ones.
pub(crate) fn rest_of(message: &RestMessage) -> Option<Rest> {
    Rest::of_parts(
        message.values.clone(),
        message.captured.clone(),
        message.at_end.clone(),
    )
}
