#![allow(clippy::unwrap_used)]

use proptest::prelude::*;
use taxel_numerics::Noise;
use taxel_numerics::linear_chain::{Chain, Transfer};

use super::*;

const PERIOD: f64 = 0.004;

/// One element with noise of 1 V, a gain of 1 V/N, and 30 N that matter.
fn balance(high_pass: f64) -> ChargeBalance {
    ChargeBalance::new(Leak {
        high_pass,
        low_pass: 0.0,
        period: PERIOD,
        deviation: 1.0,
        matters: vec![[30.0, 30.0]],
    })
}

/// What is shown in each frame by outputs that these forces give, with an offset that is known
/// to be zero within 0.1 V.
fn shown(high_pass: f64, offset: f64, forces: &[f64], seed: u64) -> Vec<Shown> {
    let chain = Chain::new(&Transfer::high_pass(1.0, high_pass)).unwrap();
    let step = chain.step(PERIOD);
    let mut memory = chain.settled(0.0);
    let mut noise = Noise::seeded(seed);
    let mut balance = balance(high_pass);
    let frames = forces.iter().map(|force| {
        let output = chain.advance(&mut memory, &step, *force) + offset + noise.normal();
        balance.begin(PERIOD);
        balance.push(0, Some(output), [0.0, 0.01], *force)
    });
    frames.collect()
}

/// Forces of touches, each of so many newtons for so many time constants, with 9 of rest after it
/// and 12 before the first.
fn pressed(high_pass: f64, touches: &[(f64, f64)]) -> Vec<f64> {
    let held = |force: f64, times: f64| vec![force; (times * high_pass / PERIOD) as usize];
    let mut forces = held(0.0, 12.0);
    for &(force, times) in touches {
        forces.extend(held(force, times));
        forces.extend(held(0.0, 9.0));
    }
    forces
}

proptest! {
    /// At rest, pressed as often as you like with any force, and back at rest for some time
    /// constants: the offset shows, within what readings of one pause tell, and that it is rest.
    #[test]
    fn touches_that_have_gone_show_the_offset(
        high_pass in 0.2..1.0_f64,
        offset in -0.2..0.2_f64,
        touches in prop::collection::vec((100.0..3000.0_f64, 0.5..4.0_f64), 1..6),
        seed in 0..1000_u64,
    ) {
        let frames = |times: f64| (times * high_pass / PERIOD) as usize;
        let shown = shown(high_pass, offset, &pressed(high_pass, &touches), seed);
        let mut at = frames(12.0);
        for (_, times) in touches {
            at += frames(times) + frames(9.0);
            // In the last time constants of each rest: chance hides some frames.
            let rest = &shown[at - frames(2.0).min(at)..at];
            let same: Vec<Option<f64>> = rest.iter().filter_map(|shown| match shown {
                Shown::Same { offset, rest: Some([force, _]) } if force.abs() < 10.0 => Some(*offset),
                _ => None,
            }).collect();
            prop_assert!(2 * same.len() > rest.len(), "{} of {}", same.len(), rest.len());
            let offsets: Vec<f64> = same.into_iter().flatten().collect();
            if offsets.is_empty() {
                continue;
            }
            let mean = offsets.iter().sum::<f64>() / offsets.len() as f64;
            prop_assert!((mean - offset).abs() < 1.5, "{mean} {offset}");
        }
    }

    /// A load that stays is neither rest nor shows an offset before its output has faded.
    #[test]
    fn a_load_that_stays_is_no_rest(
        high_pass in 0.2..1.0_f64,
        force in 60.0..3000.0_f64,
        seed in 0..1000_u64,
    ) {
        let frames = |times: f64| (times * high_pass / PERIOD) as usize;
        let mut forces = vec![0.0; frames(12.0)];
        forces.extend(vec![force; frames(30.0)]);
        let shown = shown(high_pass, 0.0, &forces, seed);
        let begun = frames(12.0);
        prop_assert!(shown[begun - 5..begun].iter().all(|shown| *shown == Shown::Faded));
        let early = &shown[begun + 1..begun + frames(8.0)];
        let none = early.iter().all(|shown| *shown == Shown::Nothing);
        prop_assert!(none, "{early:?}");
        prop_assert_eq!(shown[shown.len() - 1], Shown::Faded);
    }
}

#[test]
fn after_a_clipped_output_nothing_is_known_of_before() {
    let mut balance = balance(0.5);
    balance.begin(PERIOD);
    let mut push = |output| balance.push(0, output, [0.0, 1.0], 0.0);
    for _ in 0..3000 {
        push(Some(0.0));
    }
    assert_eq!(push(Some(0.0)), Shown::Faded);
    assert_eq!(push(None), Shown::Nothing);
    assert_eq!(push(Some(0.0)), Shown::Nothing);
}

/// Sequences in which a moment was remembered that is hardly known, or a hard press was forgotten
/// while it left more open than what matters: nothing was rest from then on.
#[test]
fn presses_that_left_much_open_are_followed_by_rest() {
    let hard = (0.207_434_408, &[(2_458.505_994_8, 2.867_940_26)][..], 0);
    let light_after_hard = [
        (100.0, 2.390_815_17),
        (465.687_287_4, 2.083_802_03),
        (100.0, 0.5),
    ];
    for (high_pass, touches, seed) in [hard, (0.272_424_358, &light_after_hard[..], 245)] {
        let frames = |times: f64| (times * high_pass / PERIOD) as usize;
        let shown = shown(high_pass, 0.0, &pressed(high_pass, touches), seed);
        let rest = &shown[shown.len() - frames(6.0)..];
        let back = |one: &&Shown| matches!(one, Shown::Same { rest: Some([force, _]), .. } if force.abs() < 10.0);
        let found = rest.iter().filter(back).count();
        assert!(10 * found > 9 * rest.len(), "{found} of {}", rest.len());
    }
}
